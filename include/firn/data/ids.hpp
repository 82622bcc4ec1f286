/// \file Gives particles their ids, which are integers. No two particles ever get the same id.
#pragma once

#include <firn/core/error.hpp>
#include <firn/data/field.hpp>

#include <algorithm>

namespace firn::inline FIRN_BUILD {

/// Gives out ids in the order 0, 1, 2, …
class Ids {
public:
    /// Returns the id that give() will give out next.
    std::uint32_t next() const { return next_; }
    /// Marks all ids below `next` as given out.
    void skip(std::uint32_t next) { next_ = std::max(next_, next); }
    /// Checks that `count` more ids can be given out.
    /// \throws parameter_error  if fewer than `count` ids are left
    void require(std::uint64_t count) const {
        if (next_ + count > no_particle)
            throw parameter_error(sentence("All ", no_particle, " ids of particles have been given out."));
    }
    /// Gives out the next id and returns it.
    /// \throws parameter_error  if all ids have been given out
    std::uint32_t give() {
        require(1);
        return next_++;
    }

private:
    std::uint32_t next_ = 0;
};

}  // namespace firn::inline FIRN_BUILD
