/// \file A vertical cut in soil whose weight is raised until it fails.
#pragma once

#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include "places.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace verification {

/// The right of a cut, H = 1 m high: soil stands behind its face at x = 0 and half as deep below its toe. The base is
/// rough, the far sides are smooth. Only the ratio γH/c counts, γ = ρ g: c = 1 kPa, and g is raised.
struct VerticalCut {
    static constexpr double height = 1, depth = 0.5, back = 2, front = 1;  // [m]
    static constexpr double density = 1000, cohesion = 1e3, young = 1e6, poisson = 0.3;
    using Soil = firn::PlaneStrain<firn::MohrCoulomb<double>>;
    using Run = firn::SimulationWith<2, Soil, firn::FBar, firn::Walls<double, 2>>;

    Run run;
    double gravity = 0;  ///< now [m/s²]

    /// \param h  cell size [m];  \param friction, dilatancy  φ and ψ
    VerticalCut(double h, firn::Angle friction, firn::Angle dilatancy)
        : run({{-front, -depth}, {back, height + 4 * h}, h},
              Soil{firn::MohrCoulomb<double>::from_properties({.young = young,
                                                               .poisson = poisson,
                                                               .cohesion = cohesion,
                                                               .friction_angle = friction,
                                                               .dilatancy_angle = dilatancy})}) {
        using namespace firn;
        run.boundary = Walls<double, 2>::all(run.domain().lower, run.domain().upper, {Contact::slip, 0});
        run.boundary.at_lower[1] = {Contact::stick, 0};
        run.boundary.at_upper[1] = {Contact::none, 0};
        auto samples = sample_box<2>({-front, -depth}, {back, height}, {.spacing = h / 2});
        std::erase_if(samples.positions, [](const auto& x) { return x[0] < 0 && x[1] > 0; });
        run.add(samples, density);
    }

    /// Time that a shear wave takes over H [s].
    static double unit() { return height / std::sqrt(young / (2 * (1 + poisson)) / density); }

    /// Raises the weight slowly to a stability number, over 40 unit()s, and waits 160 more, with damping.
    /// \return  the largest distance by which a particle has moved in the last 80 [m]
    double raise_to(double n) {
        const double to = n * cohesion / (density * height), from = gravity;
        const auto wait = [&](double g, double time) {
            run.advance(time * unit(), firn::Damped<double, 2>{.field = {{0, -g}}, .rate = 0.5 / unit()});
        };
        for (int k = 1; k <= 40; ++k) wait(from + (to - from) * k / 40, 1);
        wait(to, 80);
        const auto before = places_of(run);
        wait(to, 80);
        gravity = to;
        return largest_motion(before, places_of(run));
    }
    /// Finds the stability number at which the cut fails: where the soil still moves by more than 1e-3 H in 80 unit()s.
    /// Trials go on from the cut at `stands`, by bisection.
    static std::pair<double, double> critical(VerticalCut cut, double stands, double fails, double tolerance) {
        cut.raise_to(stands);
        while (fails - stands > tolerance) {
            const double middle = (stands + fails) / 2;
            VerticalCut trial = cut;
            if (trial.raise_to(middle) > 1e-3 * height)
                fails = middle;
            else
                stands = middle, cut = trial;
        }
        return {stands, fails};
    }
};

}  // namespace verification
