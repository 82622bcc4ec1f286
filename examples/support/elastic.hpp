/// \file What 02 and 03 share: bodies of one elastic material, run once, or twice with other constants. Two runs are
/// set side by side, as a table and a picture.
#pragma once

#include "support/run.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace example {

/// The constants of an elastic material.
struct Elastic {
    double young = 1e3;  ///< Young's modulus E [Pa]
    double poisson = 0.3;

    [[nodiscard]] std::string text() const { return firn::sentence("E = ", young, " Pa, ν = ", poisson); }
};

/// The options --young, --poisson, --other-young, --other-poisson and --force.
class ElasticOptions {
public:
    explicit ElasticOptions(CommandLine& line) {
        const char* of_second = " of a second run, which is set beside the first";
        line.add("--young", first_.young, "Young's modulus in Pa", least_young, most_young);
        line.add("--poisson", first_.poisson, "Poisson's ratio", least_poisson, most_poisson);
        line.add("--other-young", other_young_, std::string("Young's modulus") + of_second, least_young, most_young);
        line.add("--other-poisson", other_poisson_, std::string("Poisson's ratio") + of_second, least_poisson,
                 most_poisson);
        line.add("--force", force_, "How stresses become forces on nodes",
                 {firn::MlsForce::name, firn::WeightGradientForce::name});
    }

    [[nodiscard]] const Elastic& first() const { return first_; }
    /// The constants of the second run, if there is one. It has those of the first that are not given for it.
    [[nodiscard]] std::optional<Elastic> other() const {
        if (!other_young_ && !other_poisson_) return std::nullopt;
        return Elastic{other_young_.value_or(first_.young), other_poisson_.value_or(first_.poisson)};
    }
    /// Returns f(force) with the force form of --force.
    template <class F>
    auto with_force(const F& f) const {
        return force_ == firn::MlsForce::name ? f(firn::MlsForce{}) : f(firn::WeightGradientForce{});
    }

private:
    static constexpr double least_young = 1.0, most_young = 1e9, least_poisson = -0.99, most_poisson = 0.495;
    Elastic first_;
    std::optional<double> other_young_, other_poisson_;
    std::string force_ = firn::MlsForce::name;
};

/// The particles of a simulation at one time.
struct Shape {
    std::vector<firn::Vec<double, 3>> positions;  ///< in the order of ids
    std::vector<Mat3> F;                          ///< deformation gradients, in the order of ids
    std::vector<double> strain;                   ///< of each body: the root mean square of ‖½ (FᵀF − I)‖

    [[nodiscard]] std::span<const firn::Vec<double, 3>> of(const firn::Body& body) const {
        return std::span(positions).subspan(body.first, body.count);
    }
};

/// \param simulation  one whose particles have never been removed
template <class Simulation>
Shape shape_of(const Simulation& simulation) {
    const auto& particles = simulation.particles();
    const auto& bodies = simulation.bodies();
    Shape shape{std::vector<firn::Vec<double, 3>>(particles.size()), std::vector<Mat3>(particles.size()),
                std::vector<double>(bodies.size())};
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto id = particles.id(slot);
        shape.positions[id] = firn::cast<double>(particles.position(slot));
        shape.F[id] = firn::cast<float>(particles.state(slot).F);
        const auto F = firn::cast<double>(shape.F[id]);
        const auto body = std::upper_bound(bodies.begin(), bodies.end(), id,
                                           [](auto number, const firn::Body& b) { return number < b.first; });
        shape.strain[std::size_t(body - bodies.begin() - 1)] +=
            0.25 * firn::squared_norm(transpose(F) * F - firn::Mat<double, 3>::identity());
    }
    for (std::size_t b = 0; b < bodies.size(); ++b)
        shape.strain[b] = std::sqrt(shape.strain[b] / std::max(1.0, double(bodies[b].count)));
    return shape;
}

/// A quantity that is measured of a run.
struct Quantity {
    const char* name;
    const char* unit;
    int digits;  ///< behind the point
};

/// The quantities of a run after one of its steps.
struct Sample {
    std::int64_t step = 0;
    double time = 0;  ///< [s]
    std::vector<double> values{};
};

/// What is measured of a run: quantities every few steps, and the particles when they were most deformed and at the
/// end.
struct Record {
    Elastic elastic;
    double spacing = 0;  ///< of the particles [m]
    View view{};         ///< of the pictures of two runs
    Shape start{};       ///< before the first step
    std::vector<firn::Body> bodies{};
    double exaggeration = 1;                      ///< of deformations, in the pictures of the greatest
    std::vector<firn::Vec<double, 3>> brought{};  ///< each body's way from the start to where deformations begin
    Outcome outcome{};
    std::int64_t begun = 0;  ///< steps that were done before a restart
    std::int64_t every = 1;  ///< steps from one sample to the next
    std::vector<Sample> samples{};
    std::size_t greatest = 0;  ///< index of the sample with the greatest deformation
    Shape at_greatest{}, at_end{};

    /// \param deformation  index of the quantity that is greatest when the bodies are most deformed
    void add(Sample sample, Shape shape, std::size_t deformation) {
        samples.push_back(std::move(sample));
        if (samples.size() == 1 || samples.back().values[deformation] > samples[greatest].values[deformation]) {
            greatest = samples.size() - 1;
            at_greatest = shape;
        }
        at_end = std::move(shape);
    }
    /// Returns the last sample up to a step.
    [[nodiscard]] const Sample& up_to(std::int64_t step) const {
        const auto later = std::upper_bound(samples.begin(), samples.end(), step,
                                            [](std::int64_t n, const Sample& sample) { return n < sample.step; });
        return later == samples.begin() ? *later : *(later - 1);
    }
    /// Returns the place of a body's particle from which its deformation is exaggerated.
    [[nodiscard]] firn::Vec<double, 3> reference(std::size_t body, std::size_t id) const {
        return body < brought.size() ? start.positions[id] + brought[body] : start.positions[id];
    }
    /// To print before results: which part of the run they are of; "" for a whole run.
    [[nodiscard]] std::string part() const {
        return outcome.part() + (begun > 0 ? firn::sentence("since step ", begun, ": ") : "");
    }
};

/// Returns the record of a run that has not begun.
/// \param frame  the part of the space that the pictures of two runs show
template <class Simulation>
Record record_of(const Simulation& simulation, const Elastic& elastic, double spacing, const Box& frame) {
    Record record{elastic, spacing};
    record.view.frame = frame;
    record.view.domain.emplace();
    for (const auto& corner : {simulation.domain().lower, simulation.domain().upper})
        record.view.domain->include({{float(corner[0]), float(corner[1]), float(corner[2])}});
    record.start = shape_of(simulation);
    record.bodies.assign(simulation.bodies().begin(), simulation.bodies().end());
    return record;
}

/// Runs a simulation with run() and records what it does.
/// \param deformation  index of the quantity that is greatest when the bodies are most deformed
/// \param quantities   quantities(shape) returns the values of the quantities
template <class Simulation, class Quantities>
void run_recorded(Simulation& simulation, const Options& options, Record& record, std::size_t deformation,
                  const Quantities& quantities) {
    const auto measure = [&] {
        Shape shape = shape_of(simulation);
        auto values = quantities(shape);
        record.add({std::int64_t(simulation.steps()), simulation.time(), std::move(values)}, std::move(shape),
                   deformation);
    };
    std::optional<std::int64_t> begun;
    record.outcome = run(simulation, options, record.spacing, {}, [&] {
        const auto done = std::int64_t(simulation.steps());
        if (!begun) begun = done - 1;
        if (done % record.every == 0) measure();
    });
    record.begun = begun.value_or(record.outcome.done);
    if (record.samples.empty() || record.samples.back().step != record.outcome.done) measure();
}

/// Prints two runs side by side, as a table in Markdown: when each is most deformed, at the end, and after as many
/// steps as the shorter run has.
inline void print_table(const Record& first, const Record& second, const std::vector<Quantity>& quantities) {
    const auto row = [](const std::string& name, const std::string& left, const std::string& right) {
        std::printf("| %s | %s | %s |\n", name.c_str(), left.c_str(), right.c_str());
    };
    const auto number = [](double x, int digits) {
        char text[64];
        std::snprintf(text, sizeof text, "%.*f", digits, x);
        return std::string(text);
    };
    const auto rows = [&](const std::string& when, const Sample& a, const Sample& b) {
        const auto moment = [&](const Sample& s) { return number(s.time, 4) + " s, step " + std::to_string(s.step); };
        row("**" + when + "**", moment(a), moment(b));
        for (std::size_t q = 0; q < quantities.size(); ++q) {
            const auto value = [&](const Sample& s) {
                return number(s.values[q], quantities[q].digits) + ' ' + quantities[q].unit;
            };
            row(quantities[q].name, value(a), value(b));
        }
    };
    std::printf("\n");
    row("", first.elastic.text(), second.elastic.text());
    row("---", "---", "---");
    rows("most deformed", first.samples[first.greatest], second.samples[second.greatest]);
    rows("at the end", first.samples.back(), second.samples.back());
    if (first.outcome.done != second.outcome.done) {
        const auto steps = std::min(first.outcome.done, second.outcome.done) / first.every * first.every;
        rows("after equal numbers of steps", first.up_to(steps), second.up_to(steps));
    }
    std::printf("\n");
}

/// Draws the bodies of a run.
/// \param exaggeration  factor of the displacements from Record::reference()
inline Image drawing(const Record& record, const Shape& shape, double exaggeration) {
    const Mat3 identity = Mat3::identity();
    Cloud cloud;
    cloud.radius = float(0.6 * record.spacing);
    for (std::size_t b = 0; b < record.bodies.size(); ++b)
        for (std::uint32_t i = 0; i < record.bodies[b].count; ++i) {
            const std::size_t id = record.bodies[b].first + i;
            const auto from = record.reference(b, id);
            cloud.positions.push_back(drawn(from + (shape.positions[id] - from) * exaggeration));
            cloud.shape.push_back(identity + (shape.F[id] - identity) * float(exaggeration));
            cloud.look.push_back(Look::skin);
            cloud.colour.push_back(std::uint8_t(b));
        }
    View view = record.view;
    view.width = view.height = 420;
    return render(cloud, view);
}

/// Draws two runs beside each other: above when each is most deformed, below at the end.
inline Image side_by_side(const Record& first, const Record& second) {
    return above(beside(drawing(first, first.at_greatest, first.exaggeration),
                        drawing(second, second.at_greatest, second.exaggeration)),
                 beside(drawing(first, first.at_end, 1), drawing(second, second.at_end, 1)));
}

/// Runs a scene once or, if other constants are given, twice, and then sets both runs side by side.
/// \param run         run(options, constants) makes a run
/// \param report      report(record) prints what a run has shown
/// \param quantities  what the samples of run() have
/// \return            an exit code for main()
template <class Run, class Report>
int run_and_compare(const Options& options, const ElasticOptions& elastic, const Run& run, const Report& report,
                    const std::vector<Quantity>& quantities) {
    const auto other = elastic.other();
    if (other && options.go_on)
        throw firn::parameter_error(
            "Two runs that are set side by side begin at the start. Leave out --go-on, or the constants of the second "
            "run.");
    if (other) std::printf("first run: %s\n", elastic.first().text().c_str());
    const Record first = run(options, elastic.first());
    if (first.outcome.has_moved()) report(first);
    if (!other || !first.outcome.has_moved() || first.outcome.is_interrupted()) return first.outcome.exit_code();

    Options others = options;
    others.name += "_other";
    std::printf("second run: %s\n", other->text().c_str());
    std::fflush(stdout);
    const Record second = run(others, *other);
    report(second);
    if (second.outcome.is_interrupted()) return second.outcome.exit_code();
    print_table(first, second, quantities);
    const auto picture = options.file("_compared.png");
    write_png(picture, side_by_side(first, second));
    std::printf("picture of both, above most deformed, below at the end: %s\n", picture.string().c_str());
    return std::max(first.outcome.exit_code(), second.outcome.exit_code());
}

}  // namespace example
