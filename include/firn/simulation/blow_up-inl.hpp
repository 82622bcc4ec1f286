/// \file Bodies of blow_up.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/simulation/blow_up.hpp>

namespace firn::inline FIRN_BUILD::detail {

/// Finds the particle with the largest signal speed, which sets the bound of the time step.
struct FastestParticle final : FactsReader {
    [[gnu::cold]] void see(ParticleFacts& one) override {
        if (one.signal_speed <= fastest_) return;  // a speed of NaN counts as the fastest
        fastest_ = one.signal_speed;
        facts_ = std::move(one);
    }
    /// Returns sentences about the fastest particle and the likely cause of its speed; an empty string if there are no
    /// particles.
    /// \param at_least  if no particle is as fast as this [m/s], the result is empty
    [[gnu::cold]] std::string text(double at_least) const {
        if (fastest_ < 0 || fastest_ < at_least) return {};
        std::string text = sentence("It is set by ", facts_.text(), ": its speed and that of waves in it add up to ",
                                    fastest_, " m/s. ");
        const double sound = facts_.undeformed_speed;
        if (sound > 0 && fastest_ > 10 * sound)
            text += sentence(
                "Waves in the material travel at ", sound, " m/s while it is not deformed. ",
                facts_.speed() > sound ? "Matter that collides faster than that" : "Matter that is deformed so far",
                " is squeezed and torn without a limit: take a stiffer material, lower speeds, "
                "more particles a cell, or a fixed_time_step far below the bound at the start.");
        else
            text += "Look for a load, a velocity, a force between particles or a stiffness that is too large.";
        return text;
    }

private:
    double fastest_ = -1;
    ParticleFacts facts_;
};

template <std::floating_point S, int D>
[[gnu::cold]] std::string fastest_particle(SetList<S, D>& sets, double at_least) {
    FastestParticle fastest;
    for (SetOf<S, D>& set : sets) set.read_facts(0, fastest);
    return fastest.text(at_least);
}

template <std::floating_point S, int D>
[[gnu::cold]] void throw_wrong_particles(SetList<S, D>& sets, const std::string& when, double dt,
                                         const std::string& cause) {
    std::string text = "a particle is not finite, or has left the domain.";
    for (SetOf<S, D>& set : sets) {
        const WrongParticles wrong =
            wrong_particles(set.partition.particles, [&](FactsReader& reader) { set.read_facts(dt, reader); });
        if (wrong.count == 0) continue;
        text = (sets.size() > 1 ? sentence("of the material ", set.name_of_material(), ", ") : "") + wrong.text();
        break;
    }
    throw particle_error(when + text + " " + cause);
}

}  // namespace firn::inline FIRN_BUILD::detail
