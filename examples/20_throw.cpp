/// \file A jelly is thrown over a wall into a box. The throw that brings it there, its velocity and its spin, is found
/// by the derivatives of whole flights, by an optimiser of another library (LBFGS++). The picture shows the first throw
/// and the one that was found.
///
/// A gradient does not see over the wall: a first throw that hits it, such as --vy 2.2, ends in front of it.
#include "support/flat_picture.hpp"
#include "support/minimise.hpp"
#include "support/run.hpp"
#include <firn/adjoint.hpp>

#include <cmath>

namespace {

using Point = firn::Vec<double, 2>;
using Jelly = firn::FixedCorotated<double>;
using Plank = firn::Collider<firn::Box<double, 2>>;
using Boundary = firn::Together<firn::Walls<double, 2>, Plank, Plank>;
using Simulation = firn::SimulationWith<2, Jelly, Boundary>;

constexpr double cell = 1.0 / 32, side = 0.15, dt = 5e-4;  // [m], [m], [s]
const Point start{0.25, 0.3}, box{1.45, 0.11};             // centres of the jelly [m]
const Point lower{0, 0}, upper{2, 1.25};                   // of the room [m]
constexpr double quarter = -1.5707963267948966;            // how far it is to have turned [rad]

Plank plank(double x, double height) {
    return {.shape = {.half_extents = {0.03, 0.5 * height}},
            .contact = firn::Contact::separate,
            .friction = 0.3,
            .thickness_in_cells = 0.5,
            .position = {x, 0.5 * height}};
}
const Plank high = plank(1.0, 0.4), low = plank(1.85, 0.3);

/// A throw: the velocity of the jelly's centre [m/s] and its spin [rad/s].
struct Throw {
    Point velocity;
    double spin;
};

/// Where a particle at `x` of the jelly comes to if the jelly is turned and moved to the box.
Point goal(const Point& x) {
    const Point arm = x - start;
    const double c = std::cos(quarter), s = std::sin(quarter);
    return box + Point{c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]};
}

class Thrower {
public:
    Thrower(const example::Options& options, double young) : options_(options), young_(young) {
        const double spacing = side / std::max(std::sqrt(double(options.particles)), 4.0);
        samples_ = firn::sample_box(start - Point::filled(0.5 * side), start + Point::filled(0.5 * side),
                                    {.spacing = spacing});
    }
    [[nodiscard]] Simulation thrown(const Throw& how) const {
        const auto walls = firn::Walls<double, 2>::all(lower, upper, {firn::Contact::separate, 0.3});
        Simulation simulation(firn::Domain<2>{lower, upper, cell}, Jelly::from_young_poisson(young_, 0.3),
                              Boundary(walls, high, low), firn::Coloured{options_.threads});
        simulation.add(samples_, 1000);
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const Point arm = particles.exact_position(slot) - start;
            particles.set_velocity(slot, how.velocity + Point{-arm[1], arm[0]} * how.spin);
            particles.set_affine(slot, firn::Mat<double, 2>::rows(0, -how.spin, how.spin, 0));
        }
        simulation.fixed_time_step = dt;
        simulation.warn = {};
        return simulation;
    }

    /// A throw as the optimiser sees it: the spin as the velocity of the jelly's edge, so that all numbers are alike.
    static Throw throw_of(const Eigen::VectorXd& x) { return {{x[0], x[1]}, x[2] / reach}; }
    static Eigen::VectorXd numbers_of(const Throw& how) {
        return Eigen::Vector3d(how.velocity[0], how.velocity[1], how.spin * reach);
    }

    /// How far the jelly is from the goal after the flight: the mean square of the distances of its particles [m²].
    /// \param by  receives the derivatives by the numbers of the throw
    double operator()(const Eigen::VectorXd& x, Eigen::VectorXd& by) {
        const Throw how = throw_of(x);
        Simulation simulation = thrown(how);
        firn::Adjoint adjoint(simulation);
        adjoint.advance(dt * double(options_.schedule.steps));
        const double per_particle = 1 / double(samples_.positions.size());
        const double value = adjoint.measure([&](const auto& p) {
            using T = std::remove_cvref_t<decltype(p.mass)>;
            const auto apart = p.position - firn::cast<T>(goal(samples_.positions[p.id]));
            return dot(apart, apart) * T(per_particle);
        });
        const auto gradient = adjoint.gradient();
        const auto& set = gradient.set();
        by.setZero();
        for (std::size_t id = 0; id < samples_.positions.size(); ++id) {
            const Point &v = set.velocity[id], from = samples_.positions[id] - start;
            by[0] += v[0], by[1] += v[1];
            by[2] += (v[1] * from[0] - v[0] * from[1] + set.affine[id](1, 0) - set.affine[id](0, 1)) / reach;
        }
        ++flights;
        std::printf("flight %2d: velocity (%.3f, %.3f) m/s, spin %6.2f rad/s: %.4f m from the goal\n", flights,
                    how.velocity[0], how.velocity[1], how.spin, std::sqrt(value));
        return value;
    }

    int flights = 0;  ///< how many were computed, with derivatives

private:
    static constexpr double reach = 0.5 * side;

    const example::Options& options_;
    double young_;
    firn::Samples<2> samples_;
};

/// Positions of the jelly's particles [m] at some moment of a flight.
using Shape = std::vector<Point>;

void paint(example::FlatPicture& picture, const std::vector<Shape>& shapes, example::Colour colour) {
    for (const Shape& shape : shapes)
        picture.paint(
            example::discs(shape, 0.7 * side / std::sqrt(double(shape.size())), [&](std::size_t) { return colour; }));
}

example::Image drawn(const std::vector<Shape>& first, const std::vector<Shape>& found) {
    example::FlatPicture picture({float(lower[0]), float(lower[1])}, {float(upper[0]), float(upper[1])}, 1280, 820);
    std::vector<example::Stroke> strokes{{{0, -0.02F}, {2, -0.02F}, 0.02F, example::slate, false}};
    for (const Plank& of : {high, low}) {
        const float x = float(of.position[0]), top = float(2 * of.position[1]);
        strokes.push_back({{x, 0.03F}, {x, top - 0.03F}, 0.03F, example::slate, false});
    }
    picture.paint(strokes);
    paint(picture, first, example::sand);
    paint(picture, found, example::coral);
    return picture.image();
}

int throw_a_jelly(int argc, char** argv) {
    example::CommandLine line({.name = "throw",
                               .about = "A jelly is thrown over a wall into a box; derivatives of whole flights find "
                                        "the throw.",
                               .particles = 400,
                               .steps = 1200,
                               .frames = 12});
    double young = 5e4;
    Throw first{{1.8, 3.2}, 0};
    std::int64_t iterations = 40;
    line.add("--young", young, "Young's modulus in Pa", 1e3, 1e6);
    line.add("--vx", first.velocity[0], "Velocity of the first throw along x in m/s", -10, 10);
    line.add("--vy", first.velocity[1], "Velocity of the first throw upwards in m/s", -10, 10);
    line.add("--spin", first.spin, "Spin of the first throw in rad/s", -50, 50);
    line.add("--iterations", iterations, "The optimiser's most iterations", 0, 1000);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    Thrower thrower(options, young);
    Eigen::VectorXd x = Thrower::numbers_of(first);
    if (iterations > 0) {
        LBFGSpp::LBFGSParam<double> settings;
        settings.max_iterations = int(iterations);
        settings.epsilon = settings.epsilon_rel = 1e-5;
        settings.past = 3;
        settings.delta = 1e-6;
        double value = 0;
        example::minimise(settings, thrower, x, value);
    }
    const Throw found = Thrower::throw_of(x);

    // Both flights again, with states of the one that was found.
    std::vector<Shape> of_first, of_found;
    Simulation before = thrower.thrown(first), simulation = thrower.thrown(found);
    example::StatesOfAll states(simulation, options);
    const auto write = [&] {
        states.write(simulation);
        of_found.push_back(example::positions(simulation));
        of_first.push_back(example::positions(before));
    };
    const auto count = [&] { return std::int64_t(example::particle_count(simulation)); };
    const auto step = [&] { simulation.step(), before.step(); };
    const example::Outcome outcome = example::run_schedule(
        options, count, {}, write, [&] { states.finish(); }, step, [&] { return drawn(of_first, of_found); },
        states.files());
    double square = 0;
    const Shape &from = of_found.front(), &to = of_found.back();
    for (std::size_t id = 0; id < to.size(); ++id) square += dot(to[id] - goal(from[id]), to[id] - goal(from[id]));
    std::printf(
        "%safter %d flights with derivatives: velocity (%.3f, %.3f) m/s, spin %.2f rad/s; the jelly ends %.4f m "
        "from the goal\n",
        outcome.part().c_str(), thrower.flights, found.velocity[0], found.velocity[1], found.spin,
        std::sqrt(square / double(to.size())));
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return throw_a_jelly(argc, argv); });
}
