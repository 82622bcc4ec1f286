/// \file A column of water collapses on a dry floor: the front, over the experiment of Martin and Moyce.
#include "scenes/dam_break.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

constexpr double end = 9.3;

struct Outcome {
    std::string label;
    FrontHistory front{};
    double energy = 0;  ///< at the end, over the start

    Curve curve(double delay = 0) const {
        Curve curve{label};
        for (std::size_t i = 0; i < front.Z.size(); ++i) curve.add(double(i) * front.interval + delay, front.Z[i]);
        return curve;
    }
    /// dZ/dT over the last two units of T.
    double speed() const { return (front.at(end) - front.at(end - 2)) / 2; }
};

template <class Transfer>
Outcome collapse(const std::string& label, int cells, Contact floor = Contact::separate) {
    using Dam = DamBreak<float, Transfer>;
    Dam dam(cells);
    dam.simulation.boundary.at_lower[1].contact = floor;
    const double start = dam.energy();
    Outcome out{label};
    out.front = dam.history(end);
    out.energy = dam.energy() / start;
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Dam break on a dry floor",
        "A column of water, a = 57.15 mm wide and 2 a high, is let go at t = 0. The speed of sound is c = 20 m/s. "
        "There is no viscosity, and no friction at walls and floor; 2 × 2 particles a cell. The front Z = x/a over the "
        "time T = t √(2g/a) is compared with Martin and Moyce 1952 (n² = 2). Their figures are taken from two "
        "transcriptions: A goes to T = 3.3, B to T = 9.2. The aim of the program slosh is an error of 5 %.");
    std::vector<Outcome> all{collapse<Apic>("APIC, h = a/10", 10)};
    if (!report.quick()) {
        all.push_back(collapse<Apic>("APIC, h = a/20", 20));
        all.push_back(collapse<Apic>("APIC, h = a/40", 40));
    }
    const int cells = report.quick() ? 10 : 20;
    const std::string h = sentence(", h = a/", cells);
    all.push_back(collapse<Aflip<>>("AFLIP" + h, cells));
    const Outcome flip = collapse<Flip<>>("FLIP" + h, cells),
                  held = collapse<Apic>("APIC, held at the floor" + h, cells, Contact::stick);
    const Outcome& finest = all[all.size() - 2];

    Plot& fronts = report.plot({"front", "Front, from the same T = 0", "T", "Z"});
    Plot& early = report.plot({"early", "Front; measured times minus the delay of the gate", "T", "Z"});
    const auto published = [](const std::string& set, double delay, double until) {
        Curve curve{"Martin and Moyce 1952, " + set, {}, {}, Curve::Kind::published};
        for (const auto& row : csv::read("martin_moyce_1952.csv"))
            if (row.at("set") == set && csv::number(row, "T") <= until)
                curve.add(csv::number(row, "T") - delay, csv::number(row, "Z"));
        return curve;
    };
    const double delay = delayed_front_error(finest.front, "A").delay;
    fronts.curves = {published("A", 0, end), published("B", 0, end)};
    early.curves = {published("A", delay, 3.5)};
    for (const Outcome& each : all) {
        fronts.curves.push_back(each.curve());
        Curve curve = each.curve();
        curve.x.resize(68), curve.y.resize(68);
        early.curves.push_back(curve);
    }
    fronts.curves.push_back(flip.curve());
    fronts.curves.push_back(held.curve());

    const auto check = [&](const Outcome& each) {
        for (const std::string set : {"A", "B"}) {
            const FrontError raw = front_error(each.front, set), shifted = delayed_front_error(each.front, set);
            report.at_most("front, mean error, " + each.label + ", set " + set, raw.mean, 0.15,
                           "from the same T = 0; interFoam, 288 × 144 cells: 9.8 % (digitalmodel, pull request 1260), "
                           "held there to 15 %");
            report.at_most(sentence("the same, measured times less ", shifted.delay), shifted.mean, 0.05,
                           "what slosh aims at; interFoam, less 0.175 for the gate: 3.0 %, 8.1 % at most");
        }
    };
    for (const Outcome& each : all) {
        check(each);
        report.check({"speed of the front for T > 7.3, " + each.label, each.speed(), 2, 0.05,
                      "Ritter 1892, no friction: 2 √(2 g a)"});
        report.at_most("energy gained at any time, " + each.label, each.front.most_energy - 1, 1e-6, "none");
    }
    if (!report.quick()) {
        double change = 0;
        for (double T = 0; T <= 3.3; T += 0.1)
            change = std::max(change, std::abs(all[1].front.at(T) - all[2].front.at(T)) / all[2].front.at(T));
        report.at_most("front, from h = a/20 to a/40, T < 3.3", change, 0.05, "a cell of the coarser grid, at Z = 1");
    }

    report.remark(
        "From the same T = 0 our front is ahead of the measured front, and the more so the finer the cells. On the "
        "finest cells it is ahead by " +
        percent(front_error(finest.front, "A").mean) + " in the mean (A), and by " +
        percent(front_error(finest.front, "A").largest) +
        " at most. Coarse cells look better by chance, because their front is late. Other computations without a gate "
        "are ahead, too: in the experiment a diaphragm takes time to leave, and T = 0 is known to a few tenths only. "
        "If one delay is taken off all measured times (" +
        sentence(delay) + ", which is " + sentence(std::round(1e4 * DamBreak<float, Apic>::unscaled(delay)) / 10) +
        " ms), the mean error is " + percent(delayed_front_error(finest.front, "A").mean) +
        ". The delay is fitted, so this figure tests the shape of the curve only.");
    report.remark(
        "After T = 4 the front of the experiment slows down, because floor and walls rub. Our front does not: without "
        "friction it tends to Ritter's speed 2 √(2 g a). If the water sticks to the floor, the front is too slow, by " +
        percent(front_error(held.front, "B").mean) +
        " in the mean (B). A layer of water two cells thick then stands still, while the real layer is thinner than 1 "
        "mm. Neither floor has the friction of the experiment, which these cells do not resolve.");
    report.remark(
        "FLIP with 5 % of PIC loses in each step a part of what the grid does not hold. The loss depends on the number "
        "of steps, not on time, and is large with small steps: " +
        percent(1 - flip.energy) + " of the energy is lost, with APIC " +
        percent(1 - (report.quick() ? all[0] : all[1]).energy) +
        ". The front of FLIP is therefore late. It is off by " + percent(front_error(flip.front, "A").mean) +
        " (A), and for that reason nearer to the experiment.");
    return report.finish();
}
