/// \file Walls whose nodes behind are mirrored: full order, symmetry to rounding, and what sticks, slides and leaves.
#include "scenes/walls.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

const Matter matter{3846.15384615, 5769.23076923, 1};  // E = 10⁴ Pa, ν = 0.3

/// Of waves between walls, and of the same waves without walls if they are periodic.
struct Study {
    Curve error;  ///< over h: the largest in time of the root of the mean square, over A
    double order() const { return fitted_order(error.x, error.y); }
};

template <class Make>
Study study(const std::string& label, const std::vector<int>& cells, double amplitude, const Make& make) {
    Study out{{label}};
    for (const int n : cells) {
        auto scene = make(1.0 / n);
        const auto steps = std::lround(scene.solution.period() / scene.simulation.fixed_time_step);
        double worst = 0;
        for (long i = 1; i <= steps; ++i) {
            scene.step();
            if (i * 20 / steps != (i - 1) * 20 / steps) worst = std::max(worst, scene.error().mean_square);
        }
        out.error.add(1.0 / n, worst / amplitude);
    }
    std::printf("%-60s", label.c_str());
    for (const double each : out.error.y) std::printf(" %9.3g", each);
    std::printf("   order %.2f\n", out.order());
    std::fflush(stdout);
    return out;
}

struct Orders {
    std::string label;
    Study held, mirrored, periodic;
};

/// \param particles  a cell and axis
template <class Solution, class Transfer>
Orders orders(const std::string& label, const std::vector<int>& cells, double amplitude, int particles,
              const Transfer& transfer = {}) {
    constexpr bool stuck = std::same_as<Solution, StuckWaves>;
    const auto waves = [&](double h) {
        return WavesBetweenWalls<double, Solution, Transfer>{{matter, amplitude}, h, particles, 0.2, transfer};
    };
    const auto walled = [&](NodesBehind nodes_behind) {
        return study(label + (stuck ? ", stick" : ", slip") + formatted(", A = %g m, ", amplitude) +
                         (nodes_behind == NodesBehind::held ? "held" : "mirrored"),
                     cells, amplitude, [&](double h) {
                         return waves(h).walled({stuck ? Contact::stick : Contact::slip, nodes_behind});
                     });
    };
    Orders out{label, walled(NodesBehind::held), walled(NodesBehind::mirrored), {}};
    if constexpr (!stuck)
        out.periodic = study(label + formatted(", periodic, A = %g m", amplitude), cells, amplitude,
                             [&](double h) { return waves(h).periodic(); });
    return out;
}

/// The largest distance of a particle from where the periodic run has it, over a period, in cells.
template <class Transfer>
double off_periodic(double h, NodesBehind nodes_behind, const Transfer& transfer = {}) {
    const WavesBetweenWalls<double, AxisAligned<2>, Transfer> waves{{matter, 0.05}, h, 2, 0.2, transfer};
    auto walled = waves.walled({Contact::slip, nodes_behind});
    auto periodic = waves.periodic();
    double largest = 0;
    const long steps = waves.steps();
    for (long i = 1; i <= steps; ++i) {
        walled.step();
        periodic.step();
        if (i % 10 == 0 || i == steps)
            largest = std::max(largest, largest_distance(walled.simulation, periodic.simulation));
    }
    return largest / h;
}

/// The largest distance of a particle from where the run of whole cubes has it, within 200 steps, over L.
template <int D, class Transfer, class Force>
double off_whole(int cells, int planes, NodesBehind nodes_behind = NodesBehind::mirrored) {
    const HalvedCubes<D, Transfer, Force> cubes{cells, planes};
    auto part = cubes.make(true, nodes_behind), whole = cubes.make(false);
    double largest = 0;
    for (int i = 1; i <= 200; ++i) {
        part.step();
        whole.step();
        if (i % 10 == 0) largest = std::max(largest, largest_distance(part, whole));
    }
    return largest / cubes.side;
}

template <class Transfer, class Force>
void check_cubes(Case& report, const std::string& label) {
    const int cells = report.quick() ? 4 : 8;
    const auto check = [&](const char* what, double off) {
        report.at_most(sentence(what, ", ", label, ": largest |Δx| over L"), off, 1e-12,
                       "a plane of symmetry changes nothing; rounding of 200 steps");
    };
    check("half of two squares", off_whole<2, Transfer, Force>(cells, 1));
    check("quarter of two squares", off_whole<2, Transfer, Force>(cells, 2));
    check("half of two cubes", off_whole<3, Transfer, Force>(cells, 1));
    check("quarter of two cubes", off_whole<3, Transfer, Force>(cells, 2));
}

template <class Transfer>
void check_cubes(Case& report, const std::string& label) {
    check_cubes<Transfer, MlsForce>(report, label + ", MLS forces");
    check_cubes<Transfer, WeightGradientForce>(report, label + ", weight gradients");
}

struct Layer {
    double lowest = 0, all = 0, strain = 0;  ///< largest errors: of the lowest row, of all, of ∂u/∂y of the lowest row
    Curve moved;
};
Layer layer(const std::string& label, bool sheared, double pull, double h, NodesBehind nodes_behind) {
    SoftLayer soft(sheared, pull, h, nodes_behind);
    soft.settle();
    Layer out;
    out.moved.label = label;
    const auto rows = soft.rows();
    const double top = soft.displacement(SoftLayer::height);
    for (const auto& row : rows) {
        out.moved.add(row.moved / SoftLayer::height, row.before / SoftLayer::height);
        out.all = std::max(out.all, std::abs(row.moved - row.expected) / top);
    }
    out.lowest = std::abs(rows.front().moved / rows.front().expected - 1);
    out.strain = std::abs((rows.front().gradient - rows.front().expected_gradient) /
                          (rows.front().expected_gradient - (sheared ? 0 : 1)));
    return out;
}

Curve slope(const std::string& label, int order, double at, double h0, double h1) {
    return {label, {h0, h1}, {at, at * std::pow(h1 / h0, order)}, Curve::Kind::reference};
}

const char* const behind[] = {"held", "mirrored"};

void check_waves(Case& report) {
    const std::vector<int> cells{8, 16, 32};
    const double small = 1e-3, large = 0.05;
    for (const bool stuck : {false, true}) {
        std::vector<Orders> all;
        const auto add = [&](const char* label, const auto& transfer) {
            const auto run = [&](double amplitude, int particles) {
                using Transfer = std::remove_cvref_t<decltype(transfer)>;
                const std::string full = sentence(label, ", ", particles, " × ", particles);
                return stuck ? orders<StuckWaves, Transfer>(full, cells, amplitude, particles, transfer)
                             : orders<AxisAligned<2>, Transfer>(full, cells, amplitude, particles, transfer);
            };
            all.push_back(run(small, 2));
            all.push_back(run(large, 4));
        };
        add("APIC", Apic{});
        add("AFLIP 0.999", Aflip<double>{0.999});
        add("FLIP 0.999", Flip<double>{0.999});
        add("FMPM(2)", Fmpm{2});
        const std::size_t of_full_order = all.size();
        add("FLIP 0.95", Flip<double>{0.95});
        add("PIC", Pic{});

        const char* const contact = stuck ? "stick" : "slip";
        Plot& plot = report.plot({contact, std::string("Waves between walls: ") + contact, "h [m]", "error / A", true});
        plot.curves = {slope("h²", 2, 0.5 * all[0].mirrored.error.y[0], 1. / 8, 1. / 32),
                       slope("h", 1, 1.5 * all[0].held.error.y[0], 1. / 8, 1. / 32)};
        for (std::size_t i = 0; i < of_full_order; i += 2) {
            plot.curves.push_back(all[i].mirrored.error);
            plot.curves.back().label = all[i].label + ", mirrored";
        }
        plot.curves.push_back(all[0].held.error);
        plot.curves.back().label = all[0].label + ", held";
        for (std::size_t i = 0; i < all.size(); ++i) {
            const std::string label = all[i].label + formatted(", A = %g m, ", i % 2 ? large : small) + contact;
            if (i < of_full_order)
                report.check({"order, " + label, std::min(all[i].mirrored.order(), 2.0), 2, 0.1,
                              "our aim: 1.8 at least; second order of splines and leapfrog"});
            else if (!stuck)
                report.at_most("error over that of periodic waves, less 1, " + label,
                               all[i].mirrored.error.y.back() / all[i].periodic.error.y.back() - 1, 1e-6,
                               "a plane of symmetry changes nothing");
            report.remark(formatted("Order of %s: mirrored %.2f, held %.2f; error/A at h = 1/32 m: %.2g and %.2g.",
                                    label.c_str(), all[i].mirrored.order(), all[i].held.order(),
                                    all[i].mirrored.error.y.back(), all[i].held.error.y.back()));
        }
    }
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Walls of full order", "TODO");
    const bool quick = report.quick();
    if (!quick) check_waves(report);
    const auto same = [&](const char* label, const auto& transfer) {
        for (const double h : {1. / 8, 1. / 16}) {
            if (quick && h < 0.1) continue;
            report.at_most(sentence("waves between slipping walls, ", label, ", h = 1/", 1 / h,
                                    " m: largest |x − x of periodic waves| over h"),
                           off_periodic(h, NodesBehind::mirrored, transfer), 1e-10,
                           "a plane of symmetry changes nothing; rounding");
        }
    };
    same("APIC", Apic{});
    same("AFLIP 0.999", Aflip<double>{0.999});
    same("FLIP 0.999", Flip<double>{0.999});
    same("FMPM(2)", Fmpm{2});
    same("PIC", Pic{});
    check_cubes<Apic>(report, "APIC");
    check_cubes<Pic>(report, "PIC");
    check_cubes<Flip<double>>(report, "FLIP 0.95");
    check_cubes<Fmpm>(report, "FMPM(2)");
    std::printf("held: %g\n", off_whole<2, Apic, MlsForce>(quick ? 4 : 8, 1, NodesBehind::held));

    for (const bool sheared : {true, false}) {
        Plot& plot = report.plot({sheared ? "shear" : "pull", sheared ? "A soft layer that sticks, sheared" : "A soft layer that sticks, pulled",
                                  "u / H", "Y / H"});
        Curve exact{"exact", {}, {}, Curve::Kind::reference};
        const SoftLayer soft(sheared, 100, 0.01, NodesBehind::held);
        for (double Y = 0; Y <= 0.1001; Y += 0.002) exact.add(soft.displacement(Y) / 0.1, Y / 0.1);
        plot.curves.push_back(exact);
        for (const NodesBehind nodes_behind : {NodesBehind::held, NodesBehind::mirrored}) {
            const char* const what = behind[int(nodes_behind)];
            for (const double h : {0.01, 0.005}) {
                const Layer of = layer(formatted("%s, h = %g mm", what, 1000 * h), sheared, 100, h, nodes_behind);
                plot.curves.push_back(of.moved);
                std::printf("%s %s h=%g: lowest %.4g all %.4g strain %.4g\n", sheared ? "shear" : "pull", what, h,
                            of.lowest, of.all, of.strain);
            }
        }
    }
    for (const NodesBehind nodes_behind : {NodesBehind::held, NodesBehind::mirrored})
        for (const auto& pull : {Vec<double, 2>{0.0, 5.0}, Vec<double, 2>{3.0, 5.0}}) {
            const auto felt = PulledOff(pull, nodes_behind).after(0.2);
            std::printf("pulled off, %s: impulse %g stress %g velocity %g\n", behind[int(nodes_behind)], felt.impulse,
                        felt.stress, felt.velocity);
        }
    return report.finish();
}
