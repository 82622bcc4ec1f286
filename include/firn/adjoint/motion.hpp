/// \file The motion of a boundary in a step, backwards.
#pragma once

#include <firn/adjoint/inputs.hpp>
#include <firn/boundary/concept.hpp>

#include <algorithm>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// The numbers of a boundary before and after it has moved for dt [s], on the tape of this thread.
template <class Boundary>
class TracedMotion {
    using P = native_pack<double>;
    using T = traced<P>;

public:
    TracedMotion(const Boundary& boundary, double dt) {
        Tape<P>::mine().cut(1);
        auto at = lift<T>(boundary);
        for_numbers<T>(at, [&](T& number) { before_.push_back(number = T::input(number.value)); });
        auto later = advanced(at, dt);
        for_numbers<T>(later, [&](const T& number) { after_.push_back(number); });
    }
    /// Returns which numbers the motion changes.
    std::vector<bool> changed() const {
        std::vector<bool> all;
        for (std::size_t k = 0; k < before_.size(); ++k) all.push_back(after_[k].node != before_[k].node);
        return all;
    }
    /// Returns the adjoints of the numbers before. \param after  those of the numbers after; what the list lacks is 0,
    /// what it has more is left out, as the program may have made a list of boundaries longer or shorter
    std::vector<double> back(const std::vector<double>& after) const {
        Tape<P>& tape = Tape<P>::mine();
        tape.begin();
        for (std::size_t k = 0; k < std::min(after.size(), after_.size()); ++k) seed(after_[k], P(after[k]));
        tape.back();
        std::vector<double> all;
        for (const T& number : before_) all.push_back(double(lane_value(adjoint_of(number), 0)));
        return all;
    }

private:
    std::vector<T> before_, after_;
};

/// Returns why the motion of a boundary has no way back; nullptr if it has one.
template <class Boundary>
const char* no_motion_back(const Boundary& boundary) {
    const char* why = nullptr;
    for_single_parts(boundary, [&]<class Part>(const Part& part, bool) {
        using Lifted = decltype(lift<traced<native_pack<double>>>(part));
        if constexpr (requires { part.advanced(0.0); } && !requires(const Lifted& of) { of.advanced(0.0); })
            why = "its function advanced() is not a template over the scalar";
        if constexpr (requires { part.shape.from_its_place(); })
            if (norm(part.shape.from_its_place().second) > 0)
                why = "its shape lies more than a hundred of its sizes from its own origin; move its points near to 0";
    });
    return why;
}

}  // namespace firn::inline FIRN_BUILD::detail
