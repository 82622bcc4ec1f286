/// \file A soft body with four muscles in its two legs learns to walk: derivatives of whole runs by what each muscle
/// does in each part of a period, and an optimiser of another library (LBFGS++), find a gait. The muscle is a material
/// of this program; its derivatives need no line of it.
///
/// The floor holds with friction, so there are kinks: the gradient is that of the branch taken, and the optimiser stops
/// where its line search finds no longer way. Another first gait may end in another one.
#include "support/flat_picture.hpp"
#include "support/minimise.hpp"
#include "support/run.hpp"
#include <firn/adjoint.hpp>

#include <cmath>
#include <random>

namespace {

using Point = firn::Vec<double, 2>;

constexpr int muscles = 4, knots = 6;      // knots: parts of a period
constexpr double period = 0.2;             // [s]
constexpr double largest_tension = 2.5e4;  // [Pa]

/// Soft matter with muscles along the y axis of the undeformed body: τ = τ(F) + a (F y)(F y)ᵀ. The tension a of each
/// muscle is given at the knots of a period, and linear between them.
template <firn::scalar S = float>
struct Muscle {
    using Tensions = firn::Vec<S, muscles * knots>;

    firn::FixedCorotated<S> passive = firn::FixedCorotated<S>::from_young_poisson(6e4, 0.3);  ///< without tension
    Tensions tension = Tensions::zero();  ///< a of muscle m at knot k: number m × knots + k [Pa]

    static constexpr const char* name = "muscle";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"passive", "", &Muscle::passive},
                          firn::parameter{"tension", "Pa", &Muscle::tension}};
    }

    template <int D>
    struct state {
        firn::DeformationGradient<S, D> F;  ///< deformation gradient [1]
        S time = S(0);                      ///< since the start [s]
        S muscle = S(-1);                   ///< which muscle the particle belongs to; −1: none

        static constexpr auto fields() {
            return std::tuple{firn::parameter{"deformation_gradient", "1", &state::F},
                              firn::parameter{"muscle_time", "s", &state::time},
                              firn::parameter{"muscle", "1", &state::muscle}};
        }
    };

    template <int D>
    state<D> updated(const state<D>& before, const firn::Mat<S, D>& velocity_gradient, const S& dt) const {
        state<D> after = firn::followed(before, velocity_gradient, dt);
        after.time = before.time + dt;
        return after;
    }
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const state<D>& of) const {
        const firn::Vec<S, D> along = of.F.column(1);
        return passive.kirchhoff_stress(of.F) + outer(along, along) * tension_of(of.muscle, of.time);
    }
    template <int D>
    S wave_speed(const S& density, const state<D>& of) const {
        return passive.wave_speed(density, of.F) + firn::sqrt(S(largest_tension) / density);
    }

private:
    S tension_of(const S& muscle, const S& time) const {
        using firn::abs, firn::floor;
        const S periods = time * S(1 / period), at = (periods - floor(periods)) * S(knots);
        S sum = S(0);
        for (int m = 0; m < muscles; ++m) {
            S own = S(0);
            for (int k = 0; k < knots; ++k) {
                const S apart = abs(at - S(k)), around = S(knots) - apart;  // the period is a ring
                const S weight = S(1) - select(apart < around, apart, around);
                own = own + select(S(0) < weight, weight, S(0)) * tension.v[m * knots + k];
            }
            sum = sum + select(abs(muscle - S(m)) < S(0.5), own, S(0));
        }
        return sum;
    }
};

using Simulation = firn::SimulationWith<2, Muscle<double>>;

constexpr double cell = 1.0 / 40, dt = 5e-4;                       // [m], [s]
constexpr double left = 0.3, leg = 0.1, gap = 0.2, height = 0.14;  // of the body on its legs [m]
constexpr double back = 0.1;                                       // thickness of the back [m]
const Point lower{0, 0}, upper{2, 0.5};                            // of the room [m]

/// Returns the muscle at a place of the body at rest: the two halves of each leg.
int muscle_at(const Point& x) {
    if (x[1] > height) return -1;
    const double along = x[0] - left;
    return along < leg ? int(along > 0.5 * leg) : 2 + int(along > leg + gap + 0.5 * leg);
}
/// Returns the tensions of muscles. \param of  numbers that may take any value
Muscle<double>::Tensions tensions(const Eigen::VectorXd& of) {
    Muscle<double>::Tensions all;
    for (int i = 0; i < muscles * knots; ++i) all.v[i] = largest_tension * std::tanh(of[i]);
    return all;
}

class Walker {
public:
    explicit Walker(const example::Options& options) : options_(options) {
        const double body = 2 * leg * height + (2 * leg + gap) * back;
        const firn::SamplingOptions sampling{.spacing = std::sqrt(body / double(options.particles)),
                                             .pattern = firn::Pattern::lattice};
        for (const double from : {left, left + leg + gap})
            parts_.push_back(sample_box(Point{from, 0}, Point{from + leg, height}, sampling));
        parts_.push_back(sample_box(Point{left, height}, Point{left + 2 * leg + gap, height + back}, sampling));
        for (const auto& part : parts_) count_ += part.positions.size();
        spacing_ = sampling.spacing;
    }
    [[nodiscard]] Simulation body(const Eigen::VectorXd& gait) const {
        Muscle<double> muscle;
        muscle.tension = tensions(gait);
        const auto walls = firn::Walls<double, 2>::all(lower, upper, {firn::Contact::separate, 0.8});
        Simulation simulation(firn::Domain<2>{lower, upper, cell}, muscle, firn::Coloured{options_.threads}, walls);
        for (const auto& part : parts_) simulation.add(part, 1000);
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            auto state = particles.state(slot);
            state.muscle = muscle_at(particles.exact_position(slot));
            particles.set_state(slot, state);
        }
        simulation.fixed_time_step = dt;
        simulation.warn = {};
        return simulation;
    }
    /// Returns minus the way that the body goes [m], and its derivatives by the gait.
    double operator()(const Eigen::VectorXd& gait, Eigen::VectorXd& by) {
        Simulation simulation = body(gait);
        firn::Adjoint adjoint(simulation);
        const double per_particle = 1 / double(count_);
        const auto place = [&](const auto& p) {
            using T = std::remove_cvref_t<decltype(p.mass)>;
            return p.position[0] * T(-per_particle);
        };
        const double start = centre();
        adjoint.advance(dt * double(options_.schedule.steps));
        const double way = -adjoint.measure(place) - start;
        const auto gradient = adjoint.gradient();
        const auto& by_tension = gradient.set().material.tension;
        for (int i = 0; i < muscles * knots; ++i) {
            const double slope = 1 / std::cosh(gait[i]);
            by[i] = by_tension.v[i] * largest_tension * slope * slope;
        }
        ++runs;
        if (way > longest) longest = way, best = gait;
        std::printf("run %2d: %.4f m in %.2f s\n", runs, way, dt * double(options_.schedule.steps));
        return -way;
    }
    /// Returns where the body's centre is at the start, along x [m].
    [[nodiscard]] double centre() const {
        double sum = 0;
        for (const auto& part : parts_)
            for (const Point& x : part.positions) sum += x[0];
        return sum / double(count_);
    }
    [[nodiscard]] double spacing() const { return spacing_; }

    int runs = 0;          ///< how many were computed, with derivatives
    double longest = -1;   ///< the longest way of all runs [m]
    Eigen::VectorXd best;  ///< the gait of that run

private:
    const example::Options& options_;
    std::vector<firn::Samples<2>> parts_;
    std::size_t count_ = 0;
    double spacing_ = 0;
};

using Shape = std::vector<Point>;

/// Draws the body at the start, and at the end with its muscles.
example::Image drawn(const std::vector<Shape>& shapes, double spacing) {
    example::FlatPicture picture({float(lower[0]), -0.05F}, {float(upper[0]), float(upper[1])}, 1280, 420);
    picture.paint(std::vector<example::Stroke>{{{0, -0.02F}, {2, -0.02F}, 0.02F, example::slate, false}});
    const Shape& rest = shapes.front();
    const std::size_t last = shapes.size() - 1;
    for (const std::size_t moment : {std::size_t(0), last})
        picture.paint(example::discs(shapes[moment], 0.7 * spacing, [&](std::size_t id) {
            const int muscle = muscle_at(rest[id]);
            return moment == 0       ? example::sand
                   : muscle < 0      ? example::coral
                   : muscle % 2 == 0 ? example::teal
                                     : example::amber;
        }));
    return picture.image();
}

int walk(int argc, char** argv) {
    example::CommandLine line({.name = "walk",
                               .about = "A soft body with muscles in its legs learns to walk, by derivatives of whole "
                                        "runs.",
                               .particles = 400,
                               .steps = 2000,
                               .frames = 12});
    std::int64_t iterations = 6, seed = 1;
    line.add("--iterations", iterations, "The optimiser's most iterations", 0, 1000);
    line.add("--seed", seed, "Seed of the first gait", 0, 1000000);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    Walker walker(options);
    std::mt19937 random{std::uint32_t(seed)};
    Eigen::VectorXd gait(muscles * knots);
    for (auto& number : gait) number = 0.2 * (double(random()) / double(std::mt19937::max()) - 0.5);
    Eigen::VectorXd by(gait.size());
    const double first = -walker(gait, by);
    double found = -first;
    // Where the line search ends at a kink, the search begins anew there, as long as that helps.
    for (bool goes_on = iterations > 0; goes_on;) {
        const double before = found;
        LBFGSpp::LBFGSParam<double> settings;
        settings.max_iterations = int(iterations);
        settings.epsilon = settings.epsilon_rel = 1e-5;
        example::minimise(settings, walker, gait, found);
        gait = walker.best;
        found = -walker.longest;
        goes_on = found < before - 0.002 && walker.runs < 10 * iterations;
    }

    Simulation simulation = walker.body(gait);
    example::StatesOfAll states(simulation, options);
    std::vector<Shape> shapes;
    const auto write = [&] {
        states.write(simulation);
        shapes.push_back(example::positions(simulation));
    };
    const auto count = [&] { return std::int64_t(example::particle_count(simulation)); };
    const example::Outcome outcome = example::run_schedule(
        options, count, {}, write, [&] { states.finish(); }, [&] { simulation.step(); },
        [&] { return drawn(shapes, walker.spacing()); }, states.files());
    double centre = 0;
    for (const Point& x : shapes.back()) centre += x[0] / double(shapes.back().size());
    std::printf("%sthe first gait goes %.4f m; the one that was found after %d runs goes %.4f m\n",
                outcome.part().c_str(), first, walker.runs, centre - walker.centre());
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return walk(argc, argv); });
}
