/// \file A warning about matter that strains so slowly that a float cannot add the strain of a step.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/stepper.hpp>
#include <firn/loops/ranks_of.hpp>
#include <firn/simulation/set_of.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Watches a sample of the particles for strain that is lost.
///
/// Of matter that has not turned, F − I is as small as its strain, and a float adds what a step strains. Matter that
/// has turned by an angle θ has numbers of the size θ in F − I, which cannot hold less than θ · 3e-8. The strain of
/// steps that strain by less is lost, or rounded up. This matters if it goes on: a body at rest strains to and fro.
class SlowStrain {
public:
    /// Looks at the particles in every 64th step. Returns a warning if most particles of a set have strained, since the
    /// watch began and in one direction, by steps that their numbers cannot hold; otherwise, and after the first
    /// warning, an empty string.
    /// \param now  after a step
    /// \param is_known  whether the transfer tells the rate of strain: it is affine
    template <std::floating_point S, int D>
    std::string look(const SetList<S, D>& sets, const Moment& now, bool is_known, const RanksOf<S, D>& ranks);

private:
    struct Sample {
        int seen = 0, below = 0;         // looks; those in which the step's strain was lost
        double strain[6] = {}, way = 0;  // ∫ of the rate of strain, by components, and of its size
        bool loses = false;              // whether what was lost matters
    };
    struct Watch {
        std::uint32_t stride = 0;  // the particles with the ids 0, stride, 2 · stride, … are watched
        std::vector<Sample> samples{};
    };

    template <std::floating_point S, int D>
    [[gnu::cold]] std::string look_at(const SetOf<S, D>& set, std::size_t number, const Moment& now);
    template <std::floating_point S, int D>
    void update(Sample& of, const GradientFacts<S, D>& gradient, const Mat<S, D>& C, const Moment& now) const;

    std::vector<Watch> watches_{};
    double last_ = 0;  // time of the last look [s]
    bool said_ = false;
};

}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_HAS_BODIES
#include <firn/simulation/slow_strain-inl.hpp>
#endif
