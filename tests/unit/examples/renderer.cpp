// sanitized: -O1
/// \file The examples' renderer and PNG writer: what hides what, what is refused, and that pictures repeat.
#include "../../../examples/support/renderer.hpp"

#include "support/catch.hpp"

#include "../../../examples/support/png.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

namespace {

using example::Cloud;
using example::Pixel;
using example::View;

constexpr std::uint8_t coral = 0;
constexpr std::uint8_t teal = 1;

bool reddish(const Pixel& p) { return p[0] > p[1] + 40 && p[0] > p[2] + 40; }
bool greenish(const Pixel& p) { return p[1] > p[0] + 40; }
bool grey(const Pixel& p) { return std::abs(p[0] - p[1]) < 25 && std::abs(p[1] - p[2]) < 25; }

template <class Like>
int count(const example::Image& image, const Like& like) {
    return static_cast<int>(std::count_if(image.pixels.begin(), image.pixels.end(), like));
}

View small() {
    View view;
    view.direction = {{0.0F, 0.0F, -1.0F}};
    view.width = 160;
    view.height = 120;
    return view;
}

Cloud block(int n, float spacing) {
    Cloud cloud;
    cloud.radius = 0.62F * spacing;
    for (int i = 0; i < n * n * n; ++i) {
        cloud.positions.push_back({spacing * static_cast<float>(i % n), spacing * static_cast<float>(i / n % n),
                                   spacing * static_cast<float>(i / n / n)});
        cloud.colour.push_back(i % n < n / 2 ? coral : teal);
    }
    return cloud;
}

}  // namespace

TEST_CASE("a sphere hides the one behind it, in any order", "[examples]") {
    // Seen along −z, the one of larger z is in front.
    Cloud cloud;
    cloud.radius = 0.4F;
    cloud.positions = {{0.0F, 0.0F, 0.5F}, {0.0F, 0.0F, -0.5F}};
    cloud.colour = {coral, teal};
    const auto image = example::render(cloud, small());
    CHECK(reddish(image.at(80, 60)));
    CHECK(count(image, greenish) == 0);

    std::swap(cloud.colour[0], cloud.colour[1]);
    CHECK(greenish(example::render(cloud, small()).at(80, 60)));
    std::swap(cloud.positions[0], cloud.positions[1]);
    CHECK(reddish(example::render(cloud, small()).at(80, 60)));
}

TEST_CASE("no particles give the background", "[examples]") {
    const auto image = example::render({}, small());
    REQUIRE(image.pixels.size() == 160 * 120);
    CHECK(count(image, grey) == 160 * 120);
    CHECK(count(image, [](const Pixel& p) { return p[0] > 180; }) == 160 * 120);
}

TEST_CASE("positions that are not finite are skipped", "[examples]") {
    auto cloud = block(6, 0.1F);
    const auto expected = example::render(cloud, small());
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        cloud.positions.push_back({bad, 0.0F, 0.0F});
        cloud.positions.push_back({0.0F, -bad, bad});
        cloud.colour.insert(cloud.colour.end(), 2, coral);
    }
    CHECK(example::render(cloud, small()).pixels == expected.pixels);

    Cloud nothing;
    nothing.positions.assign(3, {std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F});
    CHECK(count(example::render(nothing, small()), grey) == 160 * 120);
}

TEST_CASE("the camera frames the particles, from any side and at any size", "[examples]") {
    for (const float spacing : {1e-3F, 1.0F, 1e3F}) {
        const auto cloud = block(6, spacing);
        for (const firn::Vec<float, 3>& direction :
             {View{}.direction, firn::Vec<float, 3>{{1.0F, 0.0F, 0.0F}}, firn::Vec<float, 3>{{0.0F, -1.0F, 0.0F}}}) {
            auto view = small();
            view.direction = direction;
            const auto image = example::render(cloud, view);
            CAPTURE(spacing, direction[0], direction[1]);
            const auto body = [](const Pixel& p) { return reddish(p) || greenish(p); };
            CHECK(count(image, body) > 160 * 120 / 8);
            bool cut = false;
            for (int x = 0; x < 160; ++x) cut = cut || body(image.at(x, 0)) || body(image.at(x, 119));
            for (int y = 0; y < 120; ++y) cut = cut || body(image.at(0, y)) || body(image.at(159, y));
            CHECK_FALSE(cut);
        }
    }
}

TEST_CASE("a flat cloud is seen from the front, x to the right and y upwards", "[examples]") {
    Cloud cloud;
    cloud.radius = 0.05F;
    cloud.positions = {{0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 0.0F}};
    cloud.colour = {coral, teal};
    auto view = small();
    view.direction = View{}.direction;
    view.width = view.height = 120;
    view.frame = view.domain = example::Box{{{0.0F, 0.0F, 0.0F}}, {{1.0F, 1.0F, 0.0F}}};
    const auto image = example::render(cloud, view);
    // The unit square fills the picture less 7 % on each side: its corners lie at 8.4 and 111.6 of 120 pixels.
    CHECK(reddish(image.at(8, 111)));
    CHECK(greenish(image.at(111, 8)));
    CHECK(grey(image.at(60, 60)));
}

TEST_CASE("a body throws a shadow on the floor", "[examples]") {
    auto view = small();
    view.direction = View{}.direction;
    view.domain = example::Box{{{-1.0F, 0.0F, -1.0F}}, {{2.0F, 2.0F, 2.0F}}};
    view.frame = view.domain;
    const auto cloud = block(10, 0.08F);
    const auto with = example::render(cloud, view);
    const auto without = example::render({}, view);
    int body = 0;
    int left = 0;
    int right = 0;
    for (int y = 0; y < 120; ++y) {
        for (int x = 0; x < 160; ++x) {
            if (!grey(with.at(x, y))) {
                ++body;
            } else if (without.at(x, y)[0] - with.at(x, y)[0] > 20) {
                ++(x < 80 ? left : right);
            }
        }
    }
    // The light stands to the left and the body hides most of its shadow: what shows of it lies on the right.
    CAPTURE(body, left, right);
    CHECK(right > body / 8);
    CHECK(left < right / 8);
}

TEST_CASE("triangles and spheres hide each other by depth, and both sides of a triangle are seen", "[examples]") {
    // A square across the view at z = 0 with a sphere before it and one behind.
    Cloud cloud;
    cloud.radius = 0.3F;
    cloud.surface.vertices = {{-1.0F, -1.0F, 0.0F}, {1.0F, -1.0F, 0.0F}, {1.0F, 1.0F, 0.0F}, {-1.0F, 1.0F, 0.0F}};
    cloud.surface.triangles = {{0, 1, 2}, {0, 2, 3}};
    cloud.surface.colour = {teal, teal};
    cloud.positions = {{0.0F, 0.0F, 0.5F}};
    cloud.colour = {coral};
    const auto before = example::render(cloud, small());
    CHECK(reddish(before.at(80, 60)));
    CHECK(greenish(before.at(55, 60)));
    CHECK(greenish(before.at(105, 60)));
    cloud.positions[0][2] = -0.5F;
    const auto behind = example::render(cloud, small());
    CHECK(greenish(behind.at(80, 60)));
    CHECK(count(behind, reddish) == 0);
    // A square of the screen without gaps: where both triangles meet, too.
    for (int i = -30; i <= 30; ++i) CHECK(greenish(behind.at(80 + i, 60 + i)));

    for (auto& triangle : cloud.surface.triangles) std::swap(triangle[1], triangle[2]);
    const auto turned = example::render(cloud, small());
    int largest = 0;
    for (std::size_t k = 0; k < turned.pixels.size(); ++k)
        for (std::size_t c = 0; c < 3; ++c)
            largest = std::max(largest, std::abs(int(turned.pixels[k][c]) - int(behind.pixels[k][c])));
    CHECK(largest <= 1);
}

TEST_CASE("a surface throws a shadow on the floor and on what lies under it", "[examples]") {
    auto view = small();
    view.direction = View{}.direction;
    view.domain = example::Box{{{-1.0F, 0.0F, -1.0F}}, {{1.0F, 1.5F, 1.0F}}};
    view.frame = view.domain;
    Cloud bare;
    bare.radius = 0.03F;
    for (int i = 0; i < 400; ++i)  // a floor of spheres
        bare.positions.push_back({0.04F * float(i % 20) - 0.2F, 0.1F, 0.04F * float(i / 20) - 0.4F});
    auto covered = bare;
    covered.surface.vertices = {{-1.2F, 1.0F, -0.9F}, {0.4F, 1.0F, -0.9F}, {0.4F, 1.0F, 0.9F}, {-1.2F, 1.0F, 0.9F}};
    covered.surface.triangles = {{0, 2, 1}, {0, 3, 2}};
    covered.surface.colour = {teal, teal};
    const auto with = example::render(covered, view);
    const auto without = example::render(bare, view);
    int paper = 0, spheres = 0;
    for (std::size_t k = 0; k < with.pixels.size(); ++k) {
        const Pixel &now = with.pixels[k], &then = without.pixels[k];
        if (greenish(now) || then[0] < now[0] + 15) continue;
        ++(reddish(then) ? spheres : paper);
    }
    CAPTURE(paper, spheres);
    CHECK(paper > 300);
    CHECK(spheres > 100);
}

TEST_CASE("the same cloud gives the same picture", "[examples]") {
    const auto cloud = block(12, 0.05F);
    CHECK(example::render(cloud, small()).pixels == example::render(cloud, small()).pixels);
}

TEST_CASE("a cloud or a view that makes no sense is refused", "[examples]") {
    auto cloud = block(2, 0.1F);
    SECTION("radius") {
        for (const float radius : {0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN()}) {
            cloud.radius = radius;
            CHECK_THROWS_AS(example::render(cloud, small()), firn::parameter_error);
        }
    }
    SECTION("colours") {
        cloud.colour.pop_back();
        CHECK_THROWS_AS(example::render(cloud, small()), firn::parameter_error);
    }
    SECTION("tones") {
        cloud.tone = {0.5F};
        CHECK_THROWS_AS(example::render(cloud, small()), firn::parameter_error);
    }
    SECTION("triangles") {
        cloud.surface = {{{0.0F, 0.0F, 0.0F}, {1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}}, {{0, 1, 3}}, {}};
        CHECK_THROWS_AS(example::render(cloud, small()), firn::parameter_error);
        cloud.surface.triangles = {{0, 1, 2}};
        CHECK_NOTHROW(example::render(cloud, small()));
        cloud.surface.colour = {coral, coral};
        CHECK_THROWS_AS(example::render(cloud, small()), firn::parameter_error);
    }
    SECTION("size") {
        auto view = small();
        view.height = 0;
        CHECK_THROWS_AS(example::render(cloud, view), firn::parameter_error);
    }
}

TEST_CASE("a picture comes back from its PNG file, and a folder is made for it", "[examples]") {
    const auto folder = std::filesystem::temp_directory_path() /
                        ("firn_png_" + std::to_string(std::random_device{}()) + std::to_string(std::random_device{}()));
    const auto path = folder / "inner" / "picture.png";
    const auto image = example::render(block(4, 0.1F), small());
    example::write_png(path, image);
    CHECK(std::distance(std::filesystem::directory_iterator(folder / "inner"), {}) == 1);

    png_image header{};
    header.version = PNG_IMAGE_VERSION;
    REQUIRE(png_image_begin_read_from_file(&header, path.c_str()) != 0);
    REQUIRE(header.width == 160U);
    REQUIRE(header.height == 120U);
    header.format = PNG_FORMAT_RGB;
    std::vector<Pixel> pixels(image.pixels.size());
    REQUIRE(png_image_finish_read(&header, nullptr, pixels.data(), 0, nullptr) != 0);
    CHECK(pixels == image.pixels);

    std::ofstream(folder / "file") << "in the way";
    CHECK_THROWS_AS(example::write_png(folder / "file" / "picture.png", image), firn::io_error);
    CHECK_THROWS_AS(example::write_png(folder / "inner", image), firn::io_error);
    CHECK_THROWS_AS(example::write_png(path, example::Image{}), firn::io_error);
    std::filesystem::remove_all(folder);
}
