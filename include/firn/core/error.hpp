/// \file The errors firn throws. Each says what was given, what is allowed and what to do.
#pragma once

#include <firn/core/requirements.hpp>

#include <sstream>
#include <stdexcept>
#include <string>

namespace firn {

/// Base of every exception that firn throws.
struct error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A parameter outside its allowed range (a negative density, ν ≥ ½, a NaN).
struct parameter_error : error {
    using error::error;
};

/// Something asked for that does not fit into the memory there is.
struct memory_error : parameter_error {
    using parameter_error::parameter_error;
};

/// A particle that is not finite, or lies or moves outside the domain.
struct particle_error : error {
    using error::error;
};

/// Sums that could exceed the range of the fixed-point integers.
struct overflow_error : error {
    using error::error;
};

/// A triangle mesh that cannot be used as asked (open, empty, broken indices).
struct mesh_error : error {
    using error::error;
};

/// A file that could not be read or written.
struct io_error : error {
    using error::error;
};

/// A GPU that is not there, is lost, or refuses a program or a command.
struct device_error : error {
    using error::error;
};

/// Something asked for at the wrong time, or in the wrong order.
struct usage_error : error {
    using error::error;
};

/// Joins its arguments into one sentence: `throw parameter_error(sentence("dt = ", dt, " s …"))`.
template <class... Parts>
[[gnu::cold, gnu::noinline]] std::string sentence(const Parts&... parts) {
    std::ostringstream out;
    out.precision(9);
    (out << ... << parts);
    return out.str();
}

}  // namespace firn
