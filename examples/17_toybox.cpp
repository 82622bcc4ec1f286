/// \file Toys tumble into a box in the plane: balls of many sizes, soft bodies, ragdolls, a bridge of rope and a ball
/// on a rope. All of them collide. Prints how fast they still are, and how far links are stretched.
#include "support/flat_picture.hpp"
#include "support/run_particles.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/data/sampling.hpp>
#include <firn/lagrangian/rope.hpp>
#include <firn/lagrangian/soft_body.hpp>

#include <numbers>

namespace {

constexpr int D = 2;
using Point = firn::Vec<double, D>;
using System = firn::ParticleSystem<D, float, firn::Verlet, firn::Walls<float, D>>;

constexpr double width = 4, height = 3, density = 200;  // [m], [m], [kg/m²]

/// A set of points that do not collide with each other, and the links that are drawn between them.
struct Toy {
    std::uint32_t first;  // its first point
    firn::Net<D> net;
    std::vector<std::uint8_t> colours;  // one per link, or one for all
    bool is_round;                      // how it is shaded
};

struct Joint {
    Point place;
    double radius;
};
constexpr double arm = 0.045, leg = 0.055;
/// Head, chest, belly, and of each side: shoulder, elbow, hand, hip, knee, foot [m].
constexpr Joint joints[] = {{{0, 0.60}, 0.12},     {{0, 0.30}, 0.12},    {{0, 0.13}, 0.11},    {{-0.13, 0.38}, arm},
                            {{-0.32, 0.30}, arm},  {{-0.50, 0.38}, arm}, {{-0.08, 0.02}, leg}, {{-0.13, -0.25}, leg},
                            {{-0.15, -0.52}, leg}, {{0.13, 0.38}, arm},  {{0.32, 0.30}, arm},  {{0.50, 0.38}, arm},
                            {{0.08, 0.02}, leg},   {{0.13, -0.25}, leg}, {{0.15, -0.52}, leg}};
/// Joints that a bone joins, and its colour. Bones between shoulders, hips and what lies between make a rigid trunk.
struct Bone {
    std::uint32_t a, b;
    std::uint8_t colour;
};
constexpr auto skin = example::sand, shirt = example::coral, trousers = example::indigo;
constexpr Bone bones[] = {{3, 9, shirt},      {3, 6, shirt},      {9, 12, shirt}, {3, 12, shirt},   {9, 6, shirt},
                          {6, 12, shirt},     {1, 3, shirt},      {1, 9, shirt},  {1, 2, shirt},    {2, 6, shirt},
                          {2, 12, shirt},     {0, 3, skin},       {0, 9, skin},   {6, 7, trousers}, {7, 8, trousers},
                          {12, 13, trousers}, {13, 14, trousers}, {3, 4, shirt},  {4, 5, skin},     {9, 10, shirt},
                          {10, 11, skin}};

class Toybox {
public:
    explicit Toybox(System& system) : system_(system) {}

    std::uint32_t add(const firn::Net<D>& net, double radius, std::vector<double> masses, std::uint8_t colour,
                      double compliance, bool is_round = false) {
        const auto first = std::uint32_t(
            system_.add(net, {.masses = std::move(masses), .radius = radius, .group = std::uint32_t(toys.size() + 1)}));
        system_.constraints.add(net, firn::ConstraintOptions{.compliance = compliance}, first);
        toys.push_back({first, net, {colour}, is_round});
        return first;
    }

    /// A ragdoll with its hips at `hips`, turned by `angle`. Points between two joints give a limb its thickness.
    void add_ragdoll(const Point& hips, double angle) {
        const double c = std::cos(angle), s = std::sin(angle);
        Toy doll{std::uint32_t(system_.points.size()), {}, {}, true};
        const auto group = std::uint32_t(toys.size() + 1);
        const auto add_point = [&](const Point& x, double radius) {
            doll.net.positions.push_back(x);
            const double mass = density * std::numbers::pi * radius * radius;
            system_.points.add({.position = x, .mass = mass, .radius = radius, .group = group});
            return std::uint32_t(doll.net.positions.size() - 1);
        };
        for (const Joint& joint : joints) {
            const auto [x, y] = joint.place.v;
            add_point(hips + Point{c * x - s * y, s * x + c * y}, joint.radius);
        }
        for (const Bone& bone : bones) {
            doll.net.links.push_back({bone.a, bone.b});
            doll.colours.push_back(bone.colour);
            if (bone.a == 0 || std::max(bone.a, bone.b) == bone.a + 6 || bone.a < 3) continue;
            const auto middle = add_point((doll.net.positions[bone.a] + doll.net.positions[bone.b]) * 0.5, arm);
            for (const std::uint32_t end : {bone.a, bone.b}) {
                doll.net.links.push_back({end, middle});
                doll.colours.push_back(bone.colour);
            }
        }
        system_.constraints.add(doll.net, firn::ConstraintOptions{}, doll.first);
        toys.push_back(std::move(doll));
    }

    std::vector<Toy> toys;

private:
    System& system_;
};

example::Image drawn(const System& system, const std::vector<Toy>& toys) {
    example::FlatPicture picture({0, 0}, {float(width), float(height)});
    const auto at = [&](std::size_t i) {
        const auto& x = system.points.position[i];
        return std::array{float(x[0]), float(x[1])};
    };
    const float w = float(width), h = float(height), edge = 0.03F;
    const std::array<float, 2> corners[] = {{-edge, h}, {-edge, -edge}, {w + edge, -edge}, {w + edge, h}};
    std::vector<example::Stroke> strokes;
    for (std::size_t k = 0; k < 3; ++k) strokes.push_back({corners[k], corners[k + 1], edge, example::slate, false});
    picture.paint(strokes);
    const std::uint8_t colours[] = {example::teal, example::amber, example::moss, example::plum, example::snow};
    for (std::size_t i = 0; i < system.points.size(); ++i) {
        if (system.points.group[i] != 0) continue;
        const example::Stroke ball{at(i), at(i), system.points.radius[i], colours[system.points.id[i] % 5]};
        picture.paint(std::span(&ball, 1));
    }
    for (const Toy& toy : toys) {
        strokes.clear();
        for (std::size_t k = 0; k < toy.net.links.size(); ++k) {
            const auto a = toy.first + toy.net.links[k].a, b = toy.first + toy.net.links[k].b;
            strokes.push_back({at(a), at(b), std::min(system.points.radius[a], system.points.radius[b]),
                               toy.colours[k % toy.colours.size()], toy.is_round});
        }
        for (std::size_t i = toy.first; i < toy.first + toy.net.positions.size(); ++i)
            if (system.points.radius[i] > 0.1F) {  // heads, bellies, the ball on the rope
                const std::uint8_t colour = i == toy.first ? skin : example::Colour(toy.colours[0]);
                strokes.push_back({at(i), at(i), system.points.radius[i], colour});
            }
        picture.paint(strokes);
    }
    return picture.image();
}

int toybox(int argc, char** argv) {
    example::CommandLine line({.name = "toybox",
                               .about = "Balls, ropes, soft bodies and ragdolls tumble into a box in the plane.",
                               .particles = 1200,
                               .steps = 6000,
                               .frames = 90});
    double dt = 1e-3, soft = 2e-5, friction = 0.4, restitution = 0.2;
    std::int64_t iterations = 8;
    line.add("--dt", dt, "Time step in s", 1e-5, 1e-2);
    line.add("--soft", soft, "Compliance of the links of soft bodies in m/N", 0, 1);
    line.add("--friction", friction, "Friction between toys and at the walls", 0, 10);
    line.add("--restitution", restitution, "Coefficient of restitution of all impacts", 0, 1);
    line.add("--iterations", iterations, "Iterations of the constraints per step", 1, 1000);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    System system(firn::Walls<float, D>::all({0, 0}, {float(width), 100}, {firn::Contact::separate, friction}));
    system.threads = options.threads;
    system.iterations = int(iterations);
    system.damping = 0.1;
    system.restitution = restitution;
    system.collisions.emplace();
    system.collisions->friction = friction;
    system.collisions->restitution = restitution;
    system.constraints.rigid_tolerance = 0.1;  // the bridge begins too short

    Toybox box(system);
    const auto along = [&](const Point& a, const Point& b, std::size_t segments, double radius, std::uint8_t colour) {
        const auto net = firn::rope<D>(a, b, segments);
        const auto first = box.add(net, radius, std::vector<double>(segments + 1, 1.0), colour, 0, true);
        system.points.pin(first);
        return first + std::uint32_t(segments);
    };
    // The bridge is longer than the way between its ends.
    const std::uint32_t bridge_end = along({0.15, 1.5}, {2.15, 1.5}, 42, 0.028, example::amber);
    for (std::uint32_t i = 0; i <= bridge_end; ++i) system.points.position[i][0] *= 0.85;
    system.points.pin(bridge_end);
    const std::uint32_t bob = along({3.05, 2.9}, {3.75, 2.15}, 20, 0.022, example::slate);
    system.points.radius[bob] = 0.17F;
    system.points.mass[bob] = 10;
    system.points.inverse_mass[bob] = 0.1F;

    const auto add_soft = [&](const firn::Samples<D>& cells, double spacing, std::uint8_t colour) {
        const auto body = firn::lattice_body(cells);
        box.add(body.net, 0.55 * spacing, body.masses(density), colour, soft);
    };
    constexpr double cell = 0.036;
    for (const auto& [x, y, colour] : {std::tuple{0.45, 2.4, example::teal}, {2.4, 0.4, example::plum}})
        add_soft(firn::sample_sphere<D>({x, y}, 0.27, {.spacing = cell}), cell, colour);
    for (const auto& [x, y, colour] : {std::tuple{1.2, 0.1, example::moss}, {1.0, 3.3, example::amber}})
        add_soft(firn::sample_box<D>({x, y}, {x + 12.001 * cell, y + 9.001 * cell}, {.spacing = cell}), cell, colour);
    box.add_ragdoll({1.4, 2.3}, 0.4);
    box.add_ragdoll({2.5, 1.7}, -0.3);

    // The rest are balls above all that, of radii that fill the box to a quarter.
    const auto left = std::max<std::int64_t>(20, options.particles - std::int64_t(system.points.size()));
    const double mean = std::sqrt(0.25 * width * height / (1.1 * std::numbers::pi * double(left)));
    const auto columns = std::max(1, int(width / (3 * mean)));
    firn::RandomSequence random(7);
    const auto uniform = [&] { return firn::unit_interval(random.bits()); };
    for (std::int64_t k = 0; k < left; ++k) {
        const double radius = mean * (0.6 + 0.8 * uniform());
        const Point x{width * (double(k % columns) + 0.3 + 0.4 * uniform()) / columns,
                      4 + mean * (3 * double(k / columns) + 0.3 * uniform())};
        system.points.add({.position = x, .mass = density * std::numbers::pi * radius * radius, .radius = radius});
    }

    const example::Outcome outcome =
        example::run(system, options, [&] { system.step(dt); }, [&] { return drawn(system, box.toys); });
    if (!outcome.has_moved()) return outcome.exit_code();
    double speed = 0, longest = 0;
    for (const auto& v : system.points.velocity) speed += double(norm(v)) / double(system.points.size());
    for (const auto& each : system.constraints.all())
        longest = std::max(longest, norm(system.points.position[each.ends[1]] - system.points.position[each.ends[0]]) /
                                        double(each.rest));
    std::printf("%s%zu points move at %.3f m/s on average; the longest link is %.3f times its length at rest\n",
                outcome.part().c_str(), system.points.size(), speed, longest);
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return toybox(argc, argv); });
}
