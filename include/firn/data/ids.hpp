/// \file Names for particles: whole numbers, each given out once.
#pragma once

#include <firn/core/error.hpp>
#include <firn/data/field.hpp>

#include <algorithm>

namespace firn {

class Ids {
public:
    /// The one that is given out next.
    std::uint32_t next() const { return next_; }
    /// Those below `next` have been given out.
    void skip(std::uint32_t next) { next_ = std::max(next_, next); }
    /// \throws parameter_error  unless so many more can be given out
    void require(std::uint64_t count) const {
        if (next_ + count > no_particle)
            throw parameter_error(sentence("All ", no_particle, " ids of particles have been given out."));
    }
    /// \throws parameter_error  if all have been given out
    std::uint32_t give() {
        require(1);
        return next_++;
    }

private:
    std::uint32_t next_ = 0;
};

}  // namespace firn
