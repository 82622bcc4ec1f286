/// \file What are bodies in a film made of? The stiffness of a jelly beam is found from how it sags and swings, the
/// friction angle of sand from how a column of it collapses: by derivatives of whole runs, and an optimiser of another
/// library (LBFGS++).
///
/// The films are runs with finer cells, with noise. The program computes how far off noise alone would bring what is
/// found. Coarse cells bring it further off: by 2 % in Young's modulus E, 5 % in Poisson's ratio ν, 2° in the friction
/// angle, and by twice as much with --particles 400. Bending shows E / (1 − ν²), to 1 %, rather than E and ν: noise
/// hides eight times as much of each as if the other were known.
///
/// Where sand yields, a derivative is that of the branch that was taken. First guesses from 10° to 50° have led to the
/// same angle, and guesses of E and ν in all corners of the bounds to the same beam.
#include "support/flat_picture.hpp"
#include "support/run.hpp"
#include <firn/adjoint.hpp>
#include <firn/core/eigen.hpp>
#include <firn/data/random.hpp>

#include <Eigen/Dense>
#include <LBFGSB.h>

#include <cmath>
#include <numbers>

namespace {

using Point = firn::Vec<double, 2>;
using Points = std::vector<Point>;
using Numbers = Eigen::VectorXd;
constexpr int moments = 8;     // of a film
constexpr double finer = 1.6;  // how much finer the cells of the run that is filmed are

/// The even number nearest to `x`. Edges of bodies with so many particles across, two in a cell, are lines of nodes.
int even(double x) { return 2 * std::max(int(std::lround(0.5 * x)), 4); }

/// A scene: a body with so many particles across, and what a film shows of it.
struct Scene {
    int across, threads;
    double cell, dt = 0.02 * cell;  // [m], [s]
    firn::Samples<2> samples;

    Scene(int across_, int threads_, const Point& left, const Point& right)
        : across(across_), threads(threads_), cell(2 * (right[1] - left[1]) / across) {
        samples = firn::sample_box(left, right, {.spacing = 0.5 * cell});
    }
    template <class Simulation>
    [[nodiscard]] Simulation filled(Simulation simulation, double density) const {
        simulation.add(samples, density);
        simulation.fixed_time_step = dt;
        simulation.warn = {};
        return simulation;
    }
};

/// A beam of jelly that a clamp holds at its left end. The film shows markers on its surface.
struct Beam : Scene {
    using Jelly = firn::FixedCorotated<double>;
    using Clamp = firn::Collider<firn::Box<double, 2>>;
    using Simulation = firn::SimulationWith<2, Jelly, Clamp>;
    static constexpr std::array names{"Young's modulus [Pa]", "Poisson's ratio"};
    static constexpr double noise = 5e-4;                  ///< of a coordinate in the film [m]
    static constexpr Point left{0, 0.3}, right{0.4, 0.4};  ///< corners
    static constexpr double held = 0.1;                    ///< where the clamp ends [m]

    Beam(int across_, int threads_) : Scene(across_, threads_, left, right), weights_(samples.positions.size(), 30) {
        for (int k = 0; k < 30; ++k)
            weights_.col(k) = weights_of({held + (right[0] - held) * (1 + k / 2) / 15, (k % 2 ? left : right)[1]});
    }
    /// The numbers that the optimiser changes, of about the same effect: ln E, in steps of a fifth, and ν.
    static Numbers numbers_of(double young, double poisson) { return Numbers{{5 * std::log(young), 5 * poisson}}; }
    static std::vector<double> values(const Numbers& x) { return {std::exp(x[0] / 5), x[1] / 5}; }
    static std::array<Numbers, 2> bounds() { return {numbers_of(2e4, 0.01), numbers_of(4e5, 0.45)}; }

    [[nodiscard]] Simulation start(const Numbers& x) const {
        const Clamp clamp{.shape = {.half_extents = {0.5 * held, 0.1}},
                          .contact = firn::Contact::stick,
                          .thickness_in_cells = 0.01,  // so that a node on its face is held, whatever the rounding
                          .position = {0.5 * held, 0.5 * (left[1] + right[1])}};
        const auto jelly = Jelly::from_young_poisson(values(x)[0], values(x)[1]);
        return filled(Simulation({{0, 0}, {0.5, 0.5}, cell}, jelly, clamp, firn::Coloured{threads}), 1000);
    }
    /// What the film shows of particles at these places: the markers' coordinates.
    [[nodiscard]] Numbers seen(const Points& at) const { return (firn::as_eigen(at) * weights_).reshaped(); }
    /// The derivatives by the places, from those by what is seen.
    [[nodiscard]] Points by_places(const Points& at, const Numbers& by_seen) const {
        Points by(at.size());
        firn::as_eigen(by) = by_seen.reshaped(2, weights_.cols()) * weights_.transpose();
        return by;
    }
    /// The derivatives by the optimiser's numbers, from those by the parameters of the material: μ = E / (2 (1 + ν))
    /// and λ = E ν / ((1 + ν) (1 − 2 ν)).
    static Numbers by_numbers(const Jelly& by, const Numbers& x) {
        const double young = values(x)[0], poisson = values(x)[1], a = 1 + poisson, b = 1 - 2 * poisson;
        const Jelly jelly = Jelly::from_young_poisson(young, poisson);
        const double mu = -jelly.mu / a, lambda = young * (1 + 2 * poisson * poisson) / (a * a * b * b);  // by ν
        return Numbers{{by.mu * jelly.mu + by.lambda * jelly.lambda, by.mu * mu + by.lambda * lambda}} / 5;
    }

private:
    /// A marker at `x` is a mean of the particles around. These weights are right for each affine motion.
    Numbers weights_of(const Point& x) const {
        const Eigen::Matrix2Xd apart = firn::as_eigen(samples.positions).colwise() - firn::as_eigen(x);
        const Numbers near = (1 - apart.colwise().squaredNorm().array() / (2.25 * cell * cell)).max(0);
        Eigen::MatrixX3d basis(near.size(), 3);
        basis << Numbers::Ones(near.size()), apart.transpose();
        const Eigen::MatrixX3d weighted = near.asDiagonal() * basis;
        return weighted * (basis.transpose() * weighted).inverse().col(0);
    }

    Eigen::MatrixXd weights_;  // one column for each marker
};

/// A column of sand that collapses. The film is so blurred that no grain is seen, only how much sand is around some
/// points: sums over the particles with the weights of a Gaussian.
struct Column : Scene {
    using Sand = firn::Sand<double>;
    using Simulation = firn::SimulationWith<2, Sand>;
    static constexpr std::array names{"friction angle [degrees]"};
    static constexpr double noise = 0.02;  ///< of a brightness in the film; 1 is where all is full of sand
    static constexpr double blur = 0.03;   ///< [m]
    static constexpr double unit = std::numbers::pi / 36;  ///< the optimiser's unit: 5° [rad]

    Column(int across_, int threads_) : Scene(across_, threads_, {0.5, 0}, {0.7, 0.2}) {
        for (int j = 0; j < 4; ++j)
            for (int i = -8; i <= 8; ++i) pixels.push_back({0.6 + 0.05 * i, 0.025 + 0.05 * j});
    }
    static Numbers numbers_of(double degrees) { return Numbers::Constant(1, degrees / 5); }
    static std::vector<double> values(const Numbers& x) { return {5 * x[0]}; }
    static std::array<Numbers, 2> bounds() { return {numbers_of(10), numbers_of(50)}; }

    [[nodiscard]] Simulation start(const Numbers& x) const {
        const Sand sand = Sand::from_properties({.friction_angle = firn::degrees(values(x)[0])});
        const firn::Domain<2> room{{0, 0}, {1.2, 0.4}, cell};
        const auto walls = firn::Walls<double, 2>::all(room.lower, room.upper, {firn::Contact::separate, 0.5});
        return filled(Simulation(room, sand, walls, firn::Coloured{threads}), 1600);
    }
    /// How much each particle adds to the brightness at a point.
    [[nodiscard]] Numbers shares(const Points& at, const Point& pixel) const {
        const Numbers squares = (firn::as_eigen(at).colwise() - firn::as_eigen(pixel)).colwise().squaredNorm();
        return samples.volume / (2 * std::numbers::pi * blur * blur) * (squares.array() / (-2 * blur * blur)).exp();
    }
    [[nodiscard]] Numbers seen(const Points& at) const {
        Numbers numbers(pixels.size());
        for (std::size_t k = 0; k < pixels.size(); ++k) numbers[Eigen::Index(k)] = shares(at, pixels[k]).sum();
        return numbers;
    }
    [[nodiscard]] Points by_places(const Points& at, const Numbers& by_seen) const {
        Points by(at.size(), Point::zero());
        for (std::size_t k = 0; k < pixels.size(); ++k) {
            const Numbers slopes = shares(at, pixels[k]) * (by_seen[Eigen::Index(k)] / (blur * blur));
            for (std::size_t id = 0; id < at.size(); ++id) by[id] += (pixels[k] - at[id]) * slopes[Eigen::Index(id)];
        }
        return by;
    }
    static Numbers by_numbers(const Sand& by, const Numbers&) { return Numbers{{by.friction_angle * unit}}; }

    Points pixels;  ///< the points around which the film shows how much sand there is [m]
};

/// What is seen at each moment of a film, one after the other.
template <class Of>
Numbers filmed(const Of& scene, const Numbers& x, double seconds) {
    auto simulation = scene.start(x);
    std::vector<double> all;
    for (int moment = 0; moment < moments; ++moment) {
        simulation.advance(seconds / moments);
        for (const double number : scene.seen(example::positions(simulation))) all.push_back(number);
    }
    return Eigen::Map<const Numbers>(all.data(), Eigen::Index(all.size()));
}

/// Looks for the parameters of a scene that explain a film.
template <class Of>
class Search {
public:
    Search(const Of& scene, const Numbers& truth, double seconds) : scene_(scene), seconds_(seconds), truth_(truth) {
        film_ = filmed(Of(even(finer * scene.across), scene.threads), truth, seconds);
        firn::RandomSequence random(1);  // made normal as Box and Muller (1958) do
        for (double& number : film_) {
            const double radius = std::sqrt(-2 * std::log(1 - firn::unit_interval(random.bits())));
            number += Of::noise * radius * std::cos(2 * std::numbers::pi * firn::unit_interval(random.bits()));
        }
    }
    Numbers end() const { return film_.tail(film_.size() / moments); }  ///< what the film shows at its end

    /// How far a run is from the film: the mean square of the differences, in squares of the noise. It would be
    /// about 1 for the run that was filmed.
    double value(const Numbers& x) const { return (filmed(scene_, x, seconds_) - film_).squaredNorm() / scale(); }
    /// \param by  receives its derivatives
    double operator()(const Numbers& x, Numbers& by) {
        auto simulation = scene_.start(x);
        firn::Adjoint adjoint(simulation);
        double sum = 0;
        for (Eigen::Index moment = 0, each = film_.size() / moments; moment < moments; ++moment) {
            adjoint.advance(seconds_ / moments);
            const Points at = example::positions(simulation);
            const Numbers apart = scene_.seen(at) - film_.segment(moment * each, each);
            sum += apart.squaredNorm() / scale();
            adjoint.measure_own(scene_.by_places(at, apart * (2 / scale())), {});
        }
        by = Of::by_numbers(adjoint.gradient().set().material, x);
        std::printf("  run %2d: %9.3f from the film with", ++runs_, sum);
        for (const double parameter : Of::values(x)) std::printf(" %.4g", parameter);
        std::printf("\n");
        return sum;
    }
    /// Compares the derivatives with differences, and looks from `x` for what explains the film best.
    Numbers find(Numbers x) {
        Numbers by;
        (*this)(x, by);
        for (Eigen::Index k = 0; k < x.size(); ++k) {
            const Numbers step = Numbers::Unit(x.size(), k) * 1e-4;
            std::printf("  its derivative by number %d: %.5g; a difference of runs: %.5g\n", int(k + 1), by[k],
                        (value(x + step) - value(x - step)) / 2e-4);
        }
        LBFGSpp::LBFGSBParam<double> settings;
        settings.max_iterations = 40, settings.epsilon = 1e-3, settings.epsilon_rel = 0, settings.delta = 1e-6;
        LBFGSpp::LBFGSBSolver<double> solver(settings);
        double lowest = 0;
        const auto [least, most] = Of::bounds();
        try {
            std::printf("%d iterations, ", solver.minimize(*this, x, lowest, least, most));
        } catch (const std::exception& stopped) {  // its line search finds nothing better
            std::printf("the optimiser stopped: %s; ", stopped.what());
        }
        report(x);
        return x;
    }

private:
    [[nodiscard]] double scale() const { return double(film_.size()) * Of::noise * Of::noise; }

    /// Prints what was found, and how far off the noise alone would bring it: standard deviations, from the derivatives
    /// of all that is seen.
    void report(const Numbers& x) const {
        Eigen::MatrixXd slopes(film_.size(), x.size());  // by the parameters, in noises
        for (Eigen::Index k = 0; k < x.size(); ++k) {
            const Numbers change = Numbers::Unit(x.size(), k) * 0.02, more = x + change, less = x - change;
            slopes.col(k) = (filmed(scene_, more, seconds_) - filmed(scene_, less, seconds_)) /
                            (Of::noise * (Of::values(more)[std::size_t(k)] - Of::values(less)[std::size_t(k)]));
        }
        const Eigen::MatrixXd information = slopes.transpose() * slopes, spread = information.inverse();
        std::printf("%d runs with derivatives; %.3f from the film, %.3f with the parameters of the film\n", runs_,
                    value(x), value(truth_));
        for (Eigen::Index k = 0; k < x.size(); ++k)
            std::printf("%s: %.4g, in the film %.4g; noise alone leaves ±%.2g, or ±%.2g if all else is known\n",
                        Of::names[std::size_t(k)], Of::values(x)[std::size_t(k)], Of::values(truth_)[std::size_t(k)],
                        std::sqrt(spread(k, k)), 1 / std::sqrt(information(k, k)));
    }

    const Of& scene_;
    double seconds_;
    Numbers truth_, film_;
    int runs_ = 0;
};

/// A scene with the first guess and with what was found, whose states are written.
template <class Simulation>
struct Both {
    const example::Options& options;
    Simulation first, found;
    example::StatesOfAll<Simulation> states{found, options};
};

void paint(example::FlatPicture& picture, const Points& points, Point aside, double radius, example::Colour colour) {
    Points moved = points;
    for (Point& x : moved) x += aside;
    picture.paint(example::discs(moved, radius, [&](std::size_t) { return colour; }));
}

/// The beams on the left and the sand on the right: the first guess, over it what was found, over it the film.
example::Image drawn(const Both<Beam::Simulation>& beams, const Both<Column::Simulation>& columns,
                     const Numbers& markers, const Points& pixels, const Numbers& brightness) {
    example::FlatPicture picture({0, 0}, {1.56F, 0.5F}, 1560, 540);
    picture.paint(std::vector<example::Stroke>{{{0.6F, 0.01F}, {1.56F, 0.01F}, 0.01F, example::slate, false},
                                               {{0.05F, 0.25F}, {0.05F, 0.45F}, 0.05F, example::slate, false}});
    const Point aside{0.48, 0.02};
    const double large = 0.4 * beams.first.domain().cell_size, small = 0.3 * columns.first.domain().cell_size;
    paint(picture, example::positions(beams.first), {}, large, example::sand);
    paint(picture, example::positions(beams.found), {}, large, example::coral);
    paint(picture, example::positions(columns.first), aside, small, example::sand);
    paint(picture, example::positions(columns.found), aside, small, example::coral);
    for (Eigen::Index k = 0; k < markers.size(); k += 2)
        paint(picture, {{markers[k], markers[k + 1]}}, {}, 0.005, example::indigo);
    for (std::size_t k = 0; k < pixels.size(); ++k)
        paint(picture, {pixels[k]}, aside, 0.012 * std::max(brightness[Eigen::Index(k)], 0.0), example::indigo);
    return picture.image();
}

int identify(int argc, char** argv) {
    example::CommandLine line(
        {.name = "identify",
         .about = "Films show how stiff jelly is, and how rough sand, by derivatives of whole runs.",
         .particles = 900,
         .steps = 1600,
         .frames = 10});
    double young = 6e4, poisson = 0.2, angle = 20;
    line.add("--young", young, "First guess of Young's modulus in Pa", 2e4, 4e5);
    line.add("--poisson", poisson, "First guess of Poisson's ratio", 0.01, 0.45);
    line.add("--angle", angle, "First guess of the friction angle in degrees", 10, 50);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();
    const Beam beam(even(std::sqrt(0.25 * double(options.particles))), options.threads);
    const Column column(even(std::sqrt(double(options.particles))), options.threads);
    const auto steps = double(options.schedule.steps);
    Search stiffness(beam, Beam::numbers_of(1.5e5, 0.35), steps * beam.dt);
    Search friction(column, Column::numbers_of(33), steps * column.dt);
    const Numbers first_jelly = Beam::numbers_of(young, poisson), first_sand = Column::numbers_of(angle);
    example::Options beam_options = options, column_options = options;
    beam_options.name += "_beam", column_options.name += "_column";
    Both<Beam::Simulation> beams{beam_options, beam.start(first_jelly), beam.start(stiffness.find(first_jelly))};
    Both<Column::Simulation> columns{column_options, column.start(first_sand), column.start(friction.find(first_sand))};
    const auto count = [&] { return std::int64_t(beam.samples.positions.size() + column.samples.positions.size()); };
    const auto write = [&] { beams.states.write(beams.found), columns.states.write(columns.found); };
    const auto finish = [&] { beams.states.finish(), columns.states.finish(); };
    const auto step = [&] { beams.first.step(), beams.found.step(), columns.first.step(), columns.found.step(); };
    const auto picture = [&] { return drawn(beams, columns, stiffness.end(), column.pixels, friction.end()); };
    const std::vector series{beams.states.files()[0], columns.states.files()[0]};
    return example::run_schedule(options, count, {}, write, finish, step, picture, series).exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return identify(argc, argv); });
}
