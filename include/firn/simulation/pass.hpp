/// \file A step as a list of passes. A pass has a name, tells what it reads and writes, and acts on a whole run with
/// one call.
#pragma once

#include <firn/data/particle_set.hpp>
#include <firn/loops/ranks_of.hpp>
#include <firn/stage/mirror_planes.hpp>
#include <firn/stage/time_step.hpp>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

template <std::floating_point S, int D>
class RunOf;

/// What passes read and write: a set of kinds of data.
enum class Data : std::uint32_t {
    none = 0,
    // Of particles and of the run. They last from step to step, and are in states.
    places = 1 << 0,      ///< positions of particles within their blocks
    velocities = 1 << 1,  ///< velocities of particles
    affine = 1 << 2,      ///< affine velocity matrices C of particles
    stresses = 1 << 3,    ///< Kirchhoff stresses of particles
    states = 1 << 4,      ///< states of the materials
    partition = 1 << 5,   ///< the blocks into which particles are sorted, and the blocks of the grid
    reports = 1 << 6,     ///< what G2P reports: signal speeds, and whether particles must be sorted
    boundary = 1 << 7,    ///< the boundary
    particles = 1 << 8,   ///< which particles there are
    // Of nodes. They last for a step: a pass that reads them follows one that writes them.
    momenta = 1 << 9,                    ///< momenta of nodes, and masses
    node_velocities = 1 << 10,           ///< velocities of nodes at the end of the step, and masses
    velocities_before_forces = 1 << 11,  ///< velocities of nodes before forces act, for transfers that blend
    averages = 1 << 12,                  ///< averaged rates of volume change, in place of the masses of nodes
    gaps = 1 << 13,                      ///< whether mirrored walls touch matter
    node_loads = 1 << 14,                ///< forces of loads on nodes
};
/// Returns the data of both.
constexpr Data operator|(Data a, Data b) { return Data(std::uint32_t(a) | std::uint32_t(b)); }
/// Returns the data that are in both.
constexpr Data operator&(Data a, Data b) { return Data(std::uint32_t(a) & std::uint32_t(b)); }
/// The data that last for a step.
inline constexpr Data data_of_a_step = Data::momenta | Data::node_velocities | Data::velocities_before_forces |
                                       Data::averages | Data::gaps | Data::node_loads;

/// What a pass works on.
enum class PassKind : std::uint8_t {
    run,       ///< the run as a whole
    sort,      ///< the order of particles in memory, and the blocks of the grid
    particle,  ///< each particle on its own
    node,      ///< each node on its own
    scatter,   ///< from particles to nodes: contributions are added
    gather     ///< from nodes to particles
};

/// The present step, as passes see it.
template <std::floating_point S, int D>
struct StepNow {
    double dt;                                    ///< Time step [s].
    int threads;                                  ///< Number of threads.
    const RanksOf<S, D>& ranks;                   ///< What the processes of the run tell each other.
    Mirrors mirrors;                              ///< The mirrored walls.
    std::function<double()> update_grid{};        ///< The grid update, with the acceleration of this step.
    std::function<std::string()> likely_cause{};  ///< A sentence about the likely cause of wrong particles.
    bool is_uniform = true;                       ///< Whether the acceleration is the same everywhere.
    Vec<double, D> acceleration{};                ///< If so, the acceleration [m/s²].
    std::size_t set = 0;                          ///< Number of the set, in passes that act set by set.
    double largest_acceleration = 0;              ///< The largest acceleration of a field at nodes [m/s²].
    bool right = true;                            ///< Whether all particles are finite and in the domain.
    bool in_float = false;                        ///< Whether dt was chosen in float. \see FixedPoint::float_steps
    double asked = 0;  ///< The step that is asked for, of which an implicit step may take a part [s].
    double left = 0;   ///< What is left of it, the present part included [s].
    double start = 0;  ///< Time at which the present step or part starts [s].

    /// Returns the time step, with how it was chosen.
    TimeStep time_step() const { return {dt, in_float, start}; }
};

/// A pass of a step: a value that knows no simulation, and is given one when it acts. So a copy of a simulation has
/// passes of its own.
template <std::floating_point S, int D>
struct Pass {
    std::string name;               ///< For errors, times and add_pass().
    PassKind kind = PassKind::run;  ///< What it works on.
    Data reads = Data::none,        ///< What it reads.
        writes = Data::none;        ///< What it writes, clears or adds to.
    bool each_set = false;          ///< Whether it acts set by set, together with its neighbours that do.
    std::function<void(RunOf<S, D>&, StepNow<S, D>&)> act{};  ///< Does the work.
};

/// The passes of a step, in their order.
template <std::floating_point S, int D>
class PassList {
public:
    /// Returns an iterator to the first pass.
    auto begin() const { return passes_.begin(); }
    /// Returns the end of the passes.
    auto end() const { return passes_.end(); }
    /// Returns the number of passes.
    std::size_t size() const { return passes_.size(); }
    /// Returns pass i, from 0.
    const Pass<S, D>& operator[](std::size_t i) const { return passes_[i]; }

    /// Adds a pass at the end, or behind the pass of the name `after`.
    /// \throws parameter_error  if the pass has no name or does nothing, if another has its name, if there is no pass
    ///                          `after`, or if it reads what no pass before it writes
    void add(Pass<S, D> pass, std::string_view after = {});

private:
    /// Returns a sentence about a pass that reads what no pass before it writes; an empty string if there is none.
    std::string what_is_missing() const;

    std::vector<Pass<S, D>> passes_;
};

/// Times of the passes of a run. \see RunOf::times
struct PassTimes {
    std::vector<std::pair<std::string, double>> seconds{};  ///< For each pass, its name and its time so far [s].

    /// Adds to the time of the pass of this name [s].
    void add(const std::string& name, double time) {
        for (auto& [of, sum] : seconds)
            if (of == name) {
                sum += time;
                return;
            }
        seconds.emplace_back(name, time);
    }
};

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/simulation/pass-inl.hpp>
#endif
