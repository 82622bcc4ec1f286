/// \file A stack of four elastic blocks stands still, by contact groups.
#include "scenes/contact_stack.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

struct Standing {
    Curve height, energy;
    double moved = 0;    ///< the largest change of the height, over the height
    double gained = 0;   ///< the largest energy above that at the start, over the elastic energy
    double tension = 0;  ///< the largest force that pulls between two blocks, over the weight of a block
    double weight = 0;   ///< mean force on the block below, over the weight above; the worst of the three
    double aside = 0;    ///< the largest way of a block aside [cells]
    double gap = 0;      ///< the largest change of the gap between two blocks [cells]
};

template <int D, class Law>
Standing stand(const std::string& label, double duration, const StackOptions& options, const Law& law,
               int threads = 1) {
    using TheStack = Stack<D, Law>;
    TheStack stack(options, law, threads);
    auto& simulation = stack.simulation;
    const double start = stack.stored_energy(), top = stack.top(), scale = stack.elastic_energy(),
                 weight = simulation.totals().mass / TheStack::count * TheStack::g;
    std::array<double, 3> gaps{}, given{};
    std::array<double, 4> places{};
    for (int i = 0; i < 3; ++i) gaps[std::size_t(i)] = stack.gap(i);
    for (int i = 0; i < 4; ++i) places[std::size_t(i)] = stack.mean(i, false)[0];
    Standing out{{label}, {label}};
    double drawn = 0;
    while (simulation.time() < duration) {
        const bool looks = simulation.steps() % 10 == 0;
        const double before = looks ? stack.stored_energy() : 0;
        simulation.step();
        if constexpr (Law::between_groups)
            for (int i = 0; i < 3; ++i) {
                const double pushed = -simulation.contact_impulses->on(i, i + 1)[1];
                given[std::size_t(i)] += pushed;
                out.tension = std::max(out.tension, -pushed / simulation.last_time_step() / weight);
            }
        if (!looks) continue;
        // Velocities belong to the middle of the step.
        const double energy =
            (simulation.totals().kinetic_energy + 0.5 * (before + stack.stored_energy()) - start) / scale;
        const double change = (stack.top() - top) / TheStack::height;
        out.moved = std::max(out.moved, std::abs(change));
        out.gained = std::max(out.gained, energy);
        for (int i = 0; i < 3; ++i) out.gap = std::max(out.gap, std::abs(stack.gap(i) - gaps[std::size_t(i)]));
        for (int i = 0; i < 4; ++i)
            out.aside = std::max(out.aside, std::abs(stack.mean(i, false)[0] - places[std::size_t(i)]) / stack.h);
        if (simulation.time() < 1) out.height.add(simulation.time(), 1e6 * change);
        if (simulation.time() < drawn) continue;
        drawn += duration / 400;
        out.energy.add(simulation.time(), 1e6 * energy);
    }
    for (int i = 0; i < 3; ++i) {
        const double error = given[std::size_t(i)] / ((3 - i) * weight * simulation.time()) - 1;
        if (std::abs(error) > std::abs(out.weight)) out.weight = error;
    }
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    const double duration = 10;
    Case report(
        argc, argv, "Stack of blocks, by contact groups",
        "Four elastic blocks lie on each other on a floor, each a contact group of its own: E = 1e6 Pa, ν = 0.3, "
        "ρ = 1000 kg/m³, side 0.25 m = 10 cells, μ = 0.5, APIC. Positions and deformation gradients start from "
        "the geostatic state of linear elasticity, σ_yy = −ρ g (H − Y). The stack should stand still for 10 s. "
        "Energies are over the elastic energy of the geostatic state, 3.6 J.");
    const double time = report.quick() ? 1 : duration;
    const std::string by = formatted(" in %g s", time);
    const CoulombContact law{.friction = 0.5};
    std::vector<Standing> runs{stand<2>("2D", time, {}, law)};
    runs.push_back(stand<3>("3D, 5 cells a block", time, {.cells = 5}, law, 0));
    for (const Standing& each : runs) {
        const std::string in = ", " + each.height.label;
        report.at_most("change of the height over the height" + in, each.moved, 1e-3, "none; our aim for 10 s");
        report.at_most("energy above that at the start, over the elastic energy" + in, each.gained, 1e-5,
                       "never: nothing drives the stack; to second order in a step");
        report.at_most("largest force that pulls between two blocks, over the weight of one" + in, each.tension, 0,
                       "none: contact is unilateral");
        report.at_most("mean force between two blocks against the weight above, relative" + in, each.weight, 1e-3,
                       "balance of forces; what vibration leaves at the end");
        report.at_most("change of the gap between two blocks" + in + " [h]", each.gap, 0.01,
                       "none; a hundredth of a cell");
        report.at_most("way of a block aside" + in + " [h]", each.aside, 1e-6,
                       "none: symmetry; friction holds rounding");
    }
    runs.push_back(stand<2>("2D, one field", time, {}, OneField{}));
    const Standing falling = stand<2>("2D, not stressed", std::min(time, 2.0), {.geostatic = false}, law);
    report.at_most("energy above that at the start, over the elastic energy, 2D, not stressed at the start",
                   falling.gained, 1e-5,
                   "never: the stack sinks and swings, and contact gives no energy; to second order in a step");
    report.at_most("largest force that pulls between two blocks, over the weight of one, 2D, not stressed at the start",
                   falling.tension, 0, "none: contact is unilateral");
    Plot& heights =
        report.plot({"height", "Height of the stack in the first second", "t [s]", "change / height [10⁻⁶]"});
    Plot& energies = report.plot({"energy", "Energy of the stack", "t [s]", "change / elastic energy [10⁻⁶]"});
    for (const Standing& each : runs) {
        heights.curves.push_back(each.height);
        energies.curves.push_back(each.energy);
    }
    report.remark(formatted("The height changes by at most %.1e of itself%s (2D), in 3D by %.1e, and in one field ",
                            runs[0].moved, by.c_str(), runs[1].moved) +
                  formatted("without groups by %.1e: the blocks are then one body. ", runs[2].moved) +
                  "The vibration that is left comes from the start: the state is that of linear elasticity, and the "
                  "material is not linear.");
    const Standing smooth = stand<2>("2D, μ = 0", std::min(time, 2.0), {}, CoulombContact{});
    const Standing gradients = stand<2>("2D, gradients of volume", std::min(time, 2.0), {},
                                        CoulombContact{.friction = 0.5, .normals = ContactNormals::volume_gradient});
    report.remark(
        formatted("With normals from gradients of volume, the height changes by %.1e in 2 s, ", gradients.moved) +
        "and the blocks lose energy at first, because the normals at their corners are askew.");
    report.remark(
        formatted("Without friction, nothing holds the blocks sideways. Rounding grows, and in 2 s a block has "
                  "moved aside by %.2g h. ",
                  smooth.aside) +
        "Normals at the edge of a block that stands out tilt outwards a little, which drives it on.");
    return report.finish();
}
