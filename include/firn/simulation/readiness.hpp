/// \file Readiness: which preparations for a step were done for a set of particles.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <cstdint>

namespace firn::inline FIRN_BUILD {

/// The level of readiness of a set of particles for a step: whether positions were checked, particles sorted and
/// stresses computed.
class Readiness {
public:
    /// The levels of readiness, in ascending order. A set at one level also meets the requirements of all lower levels.
    enum Value : std::uint8_t {
        spoiled,   ///< a step failed half-way: the particles cannot be used until they are restored
        changed,   ///< the positions must be checked: the program may have changed particles
        inside,    ///< all positions lie in the domain
        prepared,  ///< the particles are sorted into blocks; the stresses and the report of G2P are up to date
        sorted     ///< prepared, and no step was taken since the particles were sorted
    };

    /// Returns whether the set is at this level or above.
    bool is(Value at_least) const { return value_ >= at_least; }

    /// If the level is above `changed`, lowers it to `changed`. Call when the program may change any field of the
    /// particles.
    void edit() { value_ = std::min(value_, changed); }
    /// If the level is above `inside`, lowers it to `inside`. Call after particles with checked positions were added,
    /// after particles were removed, or if nothing in the set can move yet.
    void unprepare() { value_ = std::min(value_, inside); }
    /// If the level is below `inside`, raises it to `inside`. Call after all positions were found to lie in the domain.
    void check() { value_ = std::max(value_, inside); }
    /// Sets the level to `sorted`. Call after sorting the particles and computing their stresses.
    void prepare() { value_ = sorted; }

    /// If the level is above `changed`, lowers it to `changed`. Call when a step begins: the set is not prepared until
    /// the step ends.
    void begin_step() { edit(); }
    /// Sets the level to `spoiled`. Call before a step changes particles: if the step fails, they cannot be used.
    void spoil() { value_ = spoiled; }
    void end_step() { value_ = prepared; }  ///< Sets the level to `prepared`. Call after a step without error.

    /// Sets the level to `prepared` or `changed`. Call after the particles were replaced by stored ones.
    /// \param in_order  whether the partition and the report were stored, too; then the level is `prepared`
    void restore(bool in_order) { value_ = in_order ? prepared : changed; }

private:
    Value value_ = changed;
};

}  // namespace firn::inline FIRN_BUILD
