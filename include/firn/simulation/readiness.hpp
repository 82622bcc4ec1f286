/// \file How far a set of particles is ready for a step.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <cstdint>

namespace firn {

/// How far a set of particles is ready for a step.
class Readiness {
public:
    /// The levels of readiness. Each includes those before it.
    enum Value : std::uint8_t {
        spoiled,   ///< a step failed half-way: particles cannot be used until they are restored
        changed,   ///< the program may have changed particles, or they were not checked yet
        inside,    ///< all positions lie in the domain
        prepared,  ///< sorted into blocks, with stress and report up to date
        sorted     ///< no step was made since they were sorted
    };

    bool is(Value at_least) const { return value_ >= at_least; }  ///< Whether the set is at this level or above.

    void edit() { value_ = std::min(value_, changed); }  ///< The program may change any field.
    /// Checked particles were added, or particles were taken out, or nothing in the set can move yet.
    void unprepare() { value_ = std::min(value_, inside); }
    void check() { value_ = std::max(value_, inside); }  ///< All positions were found to lie in the domain.
    void prepare() { value_ = sorted; }                  ///< Particles were sorted, and their stress was computed.

    void begin_step() { edit(); }           ///< A step begins: the set is not prepared until the step ends.
    void spoil() { value_ = spoiled; }      ///< A step changes the particles: if it fails, they cannot be used.
    void end_step() { value_ = prepared; }  ///< A step has ended without error.

    /// Particles were replaced by stored ones.
    /// \param in_order  whether their partition and report were stored with them
    void restore(bool in_order) { value_ = in_order ? prepared : changed; }

private:
    Value value_ = changed;
};

}  // namespace firn
