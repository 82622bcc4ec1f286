/// \file How far a set of particles is ready for a step: one value, and all that changes it.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <cstdint>

namespace firn {

/// What is known of a set of particles. Each value includes those before it.
class Readiness {
public:
    enum Value : std::uint8_t {
        spoiled,   ///< a step that failed half-way has left particles of no use, until they are restored
        changed,   ///< particles were changed by hand, or not looked at yet
        inside,    ///< all positions lie in the domain
        prepared,  ///< sorted into blocks, with stress and report up to date
        sorted     ///< and no step was made since they were sorted
    };

    bool is(Value at_least) const { return value_ >= at_least; }

    void edit() { value_ = std::min(value_, changed); }  ///< the program may change any field
    /// Particles were added, which were checked, or taken out; or prepared as they are they cannot take a step.
    void unprepare() { value_ = std::min(value_, inside); }
    void check() { value_ = std::max(value_, inside); }
    void prepare() { value_ = sorted; }

    void begin_step() { edit(); }  ///< until it ends well
    void spoil() { value_ = spoiled; }
    void end_step() { value_ = prepared; }

    /// \param in_order  whether they come with their partition and report
    void restore(bool in_order) { value_ = in_order ? prepared : changed; }

private:
    Value value_ = changed;
};

}  // namespace firn
