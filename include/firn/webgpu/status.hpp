/// \file What a program tells in the buffer "status".
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>
#include <firn/loops/g2p.hpp>
#include <firn/wgsl/manifest.hpp>

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu {

/// The value of Status::particle that means "no particle": there is no error, or the error does not concern a single
/// particle.
inline constexpr std::uint32_t no_particle = 0xffffffff;

/// The contents of the buffer "status": the error (if there is one), and the maxima and scales of the last step.
struct Status {
    std::uint32_t error;  ///< error code: 0 if there is no error, else wgsl::error_sentences[error − 1] is the message
    std::uint32_t particle;  ///< lowest index of a particle that causes the error, or no_particle
    float signal_speed;      ///< largest signal speed (speed plus wave speed) of a particle [m/s]
    float largest_momentum,  ///< largest q of all particles [kg m/s]; a particle adds at most N q + |∇N| g to each
                             ///< momentum component of a node with weight N [1] and weight gradient ∇N [1/cell]
        largest_gradient;  ///< largest g of all particles [kg m/s]; g is the factor of |∇N| in the bound N q + |∇N| g,
                           ///< which largest_momentum explains
    float largest_mass;    ///< largest mass of a particle [kg]
    float most_particles;  ///< largest number of particles with the same base node (first node that they touch)
    float momentum_scale;  ///< scale of the integer sums at nodes: integer units (quanta) of momentum per kg m/s
    float mass_scale;      ///< scale of the integer sums at nodes: integer units (quanta) of mass per kg
    float largest_acceleration;   ///< largest acceleration of the field at a node that limits the time step [m/s²]
    double time_left;             ///< time left of the last advance() [s]; 0 when it has arrived
    std::uint32_t steps;          ///< number of steps since the last advance() or begin(), or since initialise()
    bool meets_sink;              ///< whether a particle may have met a sink in the last step
    std::uint32_t set;            ///< number of the set of particles that has the error
    std::vector<G2PReport> sets;  ///< the report of each set, in the order of the uniform "set_number"
};

namespace detail {

/// Throws the error of a program with a text: an overflow_error, a particle_error or a parameter_error.
/// \param error  the error code, see Status::error
[[noreturn, gnu::cold]] inline void throw_error(std::uint32_t error, const std::string& text) {
    constexpr std::uint32_t first_of_particles = 4;
    if (error == wgsl::detail::mirror_error || error == wgsl::detail::blocks_error) throw parameter_error(text);
    if (error < first_of_particles || error == wgsl::detail::reaction_error) throw overflow_error(text);
    throw particle_error(text);
}

/// Returns the words of the buffer "status" without an error. \param time  [s], for a program that keeps it
inline std::vector<std::uint32_t> words_at(const wgsl::Program& program, double time) {
    std::vector<std::uint32_t> words(std::size_t(program.buffer("status").count));
    words.at(1) = no_particle;
    if (!program.keeps_time) return words;
    const TimeLeft<float> split = time_left(time);
    words.at(wgsl::detail::time_word) = std::bit_cast<std::uint32_t>(split.high);
    words.at(wgsl::detail::time_low_word) = std::bit_cast<std::uint32_t>(split.low);
    return words;
}

/// Returns the status from the words of the buffer.
inline Status status_of(const std::vector<std::uint32_t>& words) {
    const auto number = [&](std::size_t k) { return std::bit_cast<float>(words.at(k)); };
    constexpr std::size_t left = wgsl::detail::time_left_word;
    std::vector<G2PReport> sets;
    for (std::size_t k = wgsl::detail::first_set_word; k < words.size(); k += wgsl::detail::words_of_set)
        sets.push_back({double(number(k + 3)), words.at(k) != 0});
    return {.error = words.at(0),
            .particle = words.at(1),
            .signal_speed = number(2),
            .largest_momentum = number(3),
            .largest_gradient = number(4),
            .largest_mass = number(5),
            .most_particles = number(6),
            .momentum_scale = number(7),
            .mass_scale = number(8),
            .largest_acceleration = number(19),
            .time_left = double(number(left)) + double(number(left + 1)),
            .steps = words.at(wgsl::detail::steps_word),
            .meets_sink = words.at(wgsl::detail::sink_word) != 0,
            .set = words.at(27),
            .sets = std::move(sets)};
}

/// Returns whether the device has stopped for the CPU to do something: without blocks for the grid, or at a sink.
inline bool is_interrupted(const Status& status) {
    return status.error == wgsl::detail::blocks_error ||
           (status.meets_sink && (status.error == 0 || status.error == wgsl::detail::sink_error));
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD::webgpu
