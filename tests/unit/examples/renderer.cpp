/// \file The examples' renderer and PNG writer: what hides what, what is refused, and that pictures repeat.
#include "../../../examples/support/renderer.hpp"

#include "support/catch.hpp"

#include "../../../examples/support/grains.hpp"
#include "../../../examples/support/png.hpp"
#include "../../../examples/support/skin.hpp"
#include "../../../examples/support/water.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace {

using example::Cloud;
using example::Look;
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

TEST_CASE("the same cloud gives the same picture, on any number of threads", "[examples]") {
    auto cloud = block(12, 0.05F);
    CHECK(example::render(cloud, small()).pixels == example::render(cloud, small()).pixels);
    for (std::size_t k = 0; k < cloud.positions.size(); ++k)
        cloud.look.push_back(Look(cloud.positions[k][1] / 0.05F / 12 * 5));  // five layers
    const auto expected = example::render(cloud, small());
#ifdef _OPENMP
    const int all = omp_get_max_threads();
    for (const int threads : {1, 3}) {
        omp_set_num_threads(threads);
        CHECK(example::render(cloud, small()).pixels == expected.pixels);
    }
    omp_set_num_threads(all);
#endif
}

TEST_CASE("a skin follows the deformation gradient: stretched matter has no holes", "[examples]") {
    // A plate of 3 layers, stretched to 2.6 times its length and width, before a floor of another colour.
    constexpr int n = 16;
    Cloud cloud;
    cloud.radius = 0.06F;
    const float spacing = 0.1F, stretch = 2.6F;
    for (int i = 0; i < n * n * 3; ++i)
        cloud.positions.push_back({stretch * spacing * float(i % n), stretch * spacing * float(i / n % n),
                                   spacing / (stretch * stretch) * float(i / n / n)});
    const auto seen = [&] {  // pixels of the particles' colour in the middle of the plate
        const auto image = example::render(cloud, small());
        int found = 0;
        for (int y = 40; y < 80; ++y)
            for (int x = 60; x < 100; ++x) found += reddish(image.at(x, y));
        return found;
    };
    CHECK(seen() < 1200);  // of 1600: balls leave holes
    cloud.look.assign(cloud.positions.size(), Look::skin);
    CHECK(seen() < 1200);
    cloud.shape.assign(cloud.positions.size(), example::Mat3::identity());
    for (auto& F : cloud.shape) {
        F(0, 0) = F(1, 1) = stretch;
        F(2, 2) = 1 / (stretch * stretch);
    }
    CHECK(seen() == 1600);
}

TEST_CASE("a skin is smoother than balls", "[examples]") {
    // The front of a block: a face of one tone, but for the shape of each ball, and its place.
    auto cloud = block(14, 0.1F);
    cloud.colour.clear();
    for (std::uint32_t k = 0; k < cloud.positions.size(); ++k)
        for (std::uint32_t a = 0; a < 3; ++a) cloud.positions[k][a] += 0.05F * (example::detail::chance(k, a) - 0.5F);
    View view = small();
    view.smoothing = 0;
    const auto roughness = [&] {
        const auto image = example::render(cloud, view);
        int sum = 0;
        for (int y = 45; y < 75; ++y)
            for (int x = 60; x < 100; ++x) sum += std::abs(int(image.at(x, y)[0]) - int(image.at(x + 1, y)[0]));
        return double(sum) / (30 * 40);
    };
    const double of_balls = roughness();
    cloud.look.assign(cloud.positions.size(), Look::skin);
    const double of_skin = roughness();
    CAPTURE(of_balls, of_skin);
    CHECK(of_skin < 0.05 * of_balls);
}

TEST_CASE("the skin of a ball is closed, and has its volume and its normals", "[examples]") {
    constexpr float spacing = 0.1F, pi = 3.14159265F;
    std::vector<std::array<float, 3>> points;
    example::Body ball;
    for (std::uint32_t k = 0; k < 21 * 21 * 21; ++k) {
        const std::array<std::uint32_t, 3> cell{k % 21, k / 21 % 21, k / 441};
        firn::Vec<float, 3> x{};
        for (std::uint32_t a = 0; a < 3; ++a)
            x[int(a)] = spacing * (float(cell[a]) - 10 + 0.6F * (example::detail::chance(k, a) - 0.5F));
        if (firn::norm(x) > 1) continue;
        ball.particles.push_back(std::uint32_t(points.size()));
        points.push_back({x[0] + 3, x[1], x[2]});
    }
    const float volume = float(points.size()) * spacing * spacing * spacing;
    const float radius = std::cbrt(volume * 3 / (4 * pi));
    example::Surface skin;
    CHECK(example::add_skin(skin, points, {}, ball, spacing).empty());
    REQUIRE(skin.normals.size() == skin.vertices.size());

    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;  // each is that of two triangles, once each way
    float enclosed = 0;
    for (const auto& t : skin.triangles) {
        std::array<firn::Vec<float, 3>, 3> x;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto& p = skin.vertices[t[k]];
            x[k] = {{p[0] - 3, p[1], p[2]}};
            ++sides[{t[k], t[(k + 1) % 3]}];
            --sides[{t[(k + 1) % 3], t[k]}];
        }
        enclosed += firn::dot(x[0], example::cross(x[1], x[2])) / 6;
    }
    CHECK(std::all_of(sides.begin(), sides.end(), [](const auto& side) { return side.second == 0; }));
    CHECK(enclosed == Approx(volume).epsilon(0.12));  // it lies a little outside

    float rough = 0, slant = 0;
    const float mean = std::cbrt(enclosed * 3 / (4 * pi));
    for (std::size_t v = 0; v < skin.vertices.size(); ++v) {
        const firn::Vec<float, 3> x{{skin.vertices[v][0] - 3, skin.vertices[v][1], skin.vertices[v][2]}};
        const firn::Vec<float, 3> n{{skin.normals[v][0], skin.normals[v][1], skin.normals[v][2]}};
        rough += (firn::norm(x) - mean) * (firn::norm(x) - mean);
        slant += 1 - firn::dot(n, x) / firn::norm(x);
    }
    rough = std::sqrt(rough / float(skin.vertices.size())) / spacing;
    slant = std::acos(1 - slant / float(skin.vertices.size())) * 180 / pi;
    CAPTURE(radius, mean, rough, slant);
    CHECK(rough < 0.14F);  // in spacings
    CHECK(slant < 6.5F);   // in degrees
}

TEST_CASE("the skin of many particles at one place is closed, at any place on the lattice", "[examples]") {
    for (const float x :
         {0.04F, 0.1787F, -0.35F, 1e4F}) {  // at the second, the field begins with a node above the level
        const std::vector<std::array<float, 3>> points(100, {x, x, x});
        example::Body body;
        for (std::uint32_t k = 0; k < points.size(); ++k) body.particles.push_back(k);
        example::Surface skin;
        CHECK(example::add_skin(skin, points, {}, body, 0.1F).empty());
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
        for (const auto& t : skin.triangles)
            for (std::size_t k = 0; k < 3; ++k) {
                ++sides[{t[k], t[(k + 1) % 3]}];
                --sides[{t[(k + 1) % 3], t[k]}];
            }
        CHECK(sides.size() > 50);
        CHECK(std::all_of(sides.begin(), sides.end(), [](const auto& side) { return side.second == 0; }));
    }
    example::Surface skin;  // too far away for the lattice
    CHECK(example::add_skin(skin, {{1e9F, 0.0F, 0.0F}}, {}, {{0}, 0}, 0.1F).size() == 1);
}

TEST_CASE("a vertex may have its own normal", "[examples]") {
    example::Surface surface{{{-1.0F, -1.0F, 0.0F}, {1.0F, -1.0F, 0.0F}, {0.0F, 1.0F, 0.0F}}, {{0, 1, 2}}, {}};
    auto camera = example::looking({{0.0F, 0.0F, -1.0F}}, {{0.0F, 1.0F, 0.0F}});
    camera.orthographic = true;
    example::frame(camera, {{{-1.0F, -1.0F, 0.0F}}, {{1.0F, 1.0F, 0.0F}}}, 20, 20, 0.0F, 0.24F);
    CHECK(example::rasterise(surface, camera, 20, 20).normal.row(12)[10][0] == Approx(0.0).margin(1e-5));
    surface.normals.assign(3, {0.6F, 0.0F, 0.8F});
    CHECK(example::rasterise(surface, camera, 20, 20).normal.row(12)[10][0] == Approx(0.6));
    surface.normals.assign(3, {0.0F, 0.0F, 0.0F});
    CHECK(example::rasterise(surface, camera, 20, 20).normal.row(12)[10][0] == Approx(0.0).margin(1e-5));
}

TEST_CASE("no particle of a skin vanishes", "[examples]") {
    for (const int particles : {1, 2, 3}) {
        for (const float distance : {0.5F, 1.0F, 2.0F, 4.0F}) {
            Cloud cloud;
            cloud.radius = 0.06F;
            for (int i = 0; i < particles; ++i) cloud.positions.push_back({0.1F * distance * float(i), 0.0F, 0.1F});
            cloud.look.assign(cloud.positions.size(), Look::skin);
            auto view = small();
            view.frame = example::Box{{{-0.3F, -0.3F, -0.3F}}, {{1.1F, 0.3F, 0.3F}}};
            const int pixels = count(example::render(cloud, view), reddish);
            CAPTURE(particles, distance, pixels);
            CHECK(pixels > (distance < 1 ? 60 : 60 * particles));
        }
    }
}

TEST_CASE("water is clear: what is behind it shows, tinted by its thickness", "[examples]") {
    const auto picture = [](int layers, bool has_ball) {
        Cloud cloud;
        cloud.radius = 0.06F;
        for (int i = 0; i < 20 * 14 * layers; ++i) {  // a sheet across the view
            cloud.positions.push_back({0.1F * float(i % 20), 0.1F * float(i / 20 % 14), 0.1F * float(i / 280)});
            cloud.colour.push_back(teal);
            cloud.look.push_back(Look::water);
        }
        for (int i = 0; has_ball && i < 512; ++i) {
            cloud.positions.push_back(
                {0.8F + 0.05F * float(i % 8), 0.5F + 0.05F * float(i / 8 % 8), -0.8F + 0.05F * float(i / 64)});
            cloud.colour.push_back(coral);
            cloud.look.push_back(Look::ball);
        }
        auto view = small();
        view.frame = example::Box{{{0.0F, 0.0F, -1.0F}}, {{2.0F, 1.4F, 1.0F}}};
        return example::render(cloud, view).at(80, 62);
    };
    // The light of the red ball, through 2 and through 8 layers of water.
    const auto thin = picture(2, true), thick = picture(8, true), none = picture(0, true);
    const auto thin_bare = picture(2, false), thick_bare = picture(8, false);
    CAPTURE(int(thin[0]), int(thick[0]), int(none[0]), int(thin_bare[0]), int(thick_bare[0]), int(thin[1]),
            int(none[1]));
    CHECK(reddish(none));
    CHECK(std::abs(int(thin[1]) - int(thin_bare[1])) > 40);  // seen through it
    CHECK(std::abs(int(thin[1]) - int(none[1])) > 10);       // but not as if there were none
    CHECK(std::abs(int(thick[1]) - int(thick_bare[1])) < std::abs(int(thin[1]) - int(thin_bare[1])));
    CHECK(thick_bare[0] + 15 < thin_bare[0]);
}

TEST_CASE("water takes the red of the light that comes through, the more the thicker it is", "[examples]") {
    const Cloud cloud = block(4, 0.1F);
    const example::detail::Scene scene(cloud, small());
    const auto through = [&](float thickness) {  // of white light, less what the water scatters
        const auto light = [&](float behind) {
            const firn::Vec<float, 3> to_eye{{0.0F, 0.0F, 1.0F}};
            return example::detail::light_of_water(scene,
                                                   {to_eye, to_eye, thickness, 1.0F, example::detail::palette()[teal],
                                                    firn::Vec<float, 3>::filled(behind)},
                                                   {{1.0F, 1.0F, 1.0F}}, {{0.5F, 0.5F, 0.5F}});
        };
        return light(1.0F) - light(0.0F);
    };
    const auto none = through(0.0F), thin = through(0.05F), thick = through(0.1F);
    for (int c = 0; c < 3; ++c) {
        CHECK(none[c] == Approx(0.98));  // 2 % are reflected
        CHECK(thick[c] / none[c] == Approx(thin[c] * thin[c] / (none[c] * none[c])).epsilon(1e-4));
    }
    CHECK(thick[0] < 0.75F * thick[1]);
    CHECK(thick[0] < 0.75F * thick[2]);
}

TEST_CASE("with a frame, what moves elsewhere does not change the picture here", "[examples]") {
    auto view = small();
    view.frame = view.domain = example::Box{{{-1.0F, 0.0F, -1.0F}}, {{2.0F, 2.0F, 2.0F}}};
    view.direction = View{}.direction;
    auto cloud = block(6, 0.1F);
    const auto before = example::render(cloud, view);
    cloud.positions.push_back({0.3F, 1.9F, 0.3F});
    cloud.colour.push_back(coral);
    const auto after = example::render(cloud, view);
    int differ = 0;
    for (std::size_t k = 0; k < before.pixels.size(); ++k) differ += before.pixels[k] != after.pixels[k];
    CHECK(differ > 0);
    CAPTURE(differ);
    CHECK(differ < 350);  // a sphere and its shadow, of 19,200 pixels
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
    SECTION("looks") {
        cloud.look = {Look::skin};
        CHECK_THROWS_AS(example::render(cloud, small()), firn::parameter_error);
    }
    SECTION("shapes") {
        cloud.shape = {example::Mat3::identity()};
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
