/// \file Templates that a program may compile in only one of its files, or link from the library firn::compiled.
#pragma once

#include <firn/simulation.hpp>
#ifdef FIRN_COMPILED
#include <firn/sort/partition.hpp>
#endif

namespace firn::inline FIRN_BUILD {

// Functions that take long to compile are defined outside of the class, so that they are not inline. A file that
// declares the simulation as `extern template class` does not compile these functions again.

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law, class Time>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law, Time>::step() {
    step(gravity);
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law, class Time>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law, Time>::advance(
    double duration) {
    advance(duration, gravity);
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law, class Time>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law, Time>::prepare() {
    if (this->prepare_sets(ranks(), workers())) activate();
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law, class Time>
Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law, Time>::Simulation(
    const Domain<D>& domain, const Material& material, const std::type_identity_t<Execution>& how,
    const std::type_identity_t<Boundary>& walls)
    : Run(domain, facts_of<Kernel>(), Make::make(material, domain)), boundary(walls), execution(how) {
    for_materials([](const auto& set, std::size_t) { check_material<D>(set.material); });
    this->passes_ = Passes::list();
    this->speaks_ = ranks().speaks();
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law, class Time>
Body Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law, Time>::add_to(
    std::size_t number, const Samples<D>& samples, double density, const Vec<double, D>& velocity) {
    const Body body = sets_[number].add(samples, density, velocity, workers(), ranks().share());
    warn_of_spacing(samples);
    return body;
}

}  // namespace firn::inline FIRN_BUILD

#ifdef FIRN_COMPILED
// The templates of the library firn::compiled. Each source file of the library defines FIRN_COMPILES as one of these
// numbers and instantiates its templates. All other files declare them `extern`.
#define FIRN_CORE_2F 1
#define FIRN_CORE_2D 2
#define FIRN_CORE_3F 3
#define FIRN_CORE_3D 4
#define FIRN_SIMULATION_2 5
#define FIRN_SIMULATION_3 6
#define FIRN_STATES 7

/// What names no policy, and P2G and the grid update with the default policies.
#define FIRN_CORE(where, S, D)                                                                                        \
    namespace firn {                                                                                                  \
    where template class ParticleStore<S, D>;                                                                         \
    where template class SparseGrid<S, D>;                                                                            \
    where template class SetOf<S, D>;                                                                                 \
    where template class PassList<S, D>;                                                                              \
    where template class RunOf<S, D>;                                                                                 \
    where template class detail::Loads<S, D>;                                                                         \
    where template class detail::BodyForces<S, D>;                                                                    \
    where template BlockPartition<D> detail::partition_places(const PlacesOfParticles<S>&, const Domain<D>&,          \
                                                              const KernelFacts&, int, std::byte*);                   \
    where template BlockPartition<D> sort_particles(const KernelFacts&, ParticleStore<S, D>&, int);                   \
    where template std::string detail::overlapping_bodies(const SetList<S, D>&);                                      \
    where template void detail::for_particles(                                                                        \
        const SetList<S, D>&, const std::type_identity_t<std::function<void(const detail::ParticleOfBody<D>&)>>&);    \
    where template double detail::StepBound::find(const detail::StepInputs<S, D>&, double, double);                   \
    where template void detail::Warnings::of_start(const SetList<S, D>&, const Domain<D>&, const Walls<S, D>&, bool,  \
                                                   const detail::Warnings::Warn&, const RanksOf<S, D>&);              \
    where template void detail::fill_arena(Arena<QuadraticBSpline, S, D>&, const S*, const BlocksAround<D>&,          \
                                           const BlockGroup&, const ArenaBox<D>&);                                    \
    where template void detail::gather_from_arena(const PackWeights<QuadraticBSpline, S, D, false>&, const S*, int,   \
                                                  PackSums<QuadraticBSpline, true, false, S, D>&);                    \
    where template void detail::gather_from_grid(const PackWeights<QuadraticBSpline, S, D, false>&, const S*,         \
                                                 const RowsInGrid<QuadraticBSpline, D>*, int,                         \
                                                 PackSums<QuadraticBSpline, true, false, S, D>&);                     \
    where template void p2g<QuadraticBSpline, Apic, MlsForce>(const Coloured&, SparseGrid<S, D>&, double,             \
                                                              ParticleSets<MotionView<S, D, BlockedSpan<S>>>);        \
    where template double detail::update_grid(int, const RankSums&, SparseGrid<S, D>&, double, const Vec<double, D>&, \
                                              const Walls<S, D>&, Reactions<D>*);                                     \
    where template void detail::mirror_nodes(int, const RankSums&, SparseGrid<S, D>&, const Mirrors&, bool,           \
                                             Reactions<D>*);                                                          \
    }
#define FIRN_SHAPES(where, D)                                                                                    \
    namespace firn {                                                                                             \
    where template void detail::Warnings::of_spacing(const Samples<D>&, const Domain<D>&,                        \
                                                     const detail::Warnings::Warn&, bool);                       \
    where template class Stepper<D>;                                                                             \
    where template class BlockSort<D>;                                                                           \
    where template BlockPartition<D> arrange(const std::vector<BlockRange<D>>&, int, int);                       \
    where template Samples<D> sample_box(const Vec<double, D>&, const Vec<double, D>&, const SamplingOptions&);  \
    where template Samples<D> sample_sphere(const Vec<double, D>&, double, const SamplingOptions&);              \
    where template std::vector<Vec<double, D>> poisson_disk_points(const Vec<double, D>&, const Vec<double, D>&, \
                                                                   double, std::uint64_t, double, int);          \
    }
/// The common simulations.
#define FIRN_SIMULATION(where, D)                                     \
    namespace firn {                                                  \
    where template class Particles<float, D, ElasticState<float, D>>; \
    where template class MaterialSet<D, FixedCorotated<float>>;       \
    where template class Simulation<D>;                               \
    }
namespace firn::inline FIRN_BUILD::detail {
/// A function that makes the linker report different options. Its name has the build in it (core/build.hpp), and it is
/// defined for the build of the library only: compile the program and the library with the same compiler and options.
void firn_compiled_has_the_same_options();
#if FIRN_COMPILES == FIRN_SIMULATION_3
void firn_compiled_has_the_same_options() {}
#elif !defined(FIRN_COMPILES)
[[gnu::used]] inline void (*const of_library)() = firn_compiled_has_the_same_options;
#endif
}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_COMPILES == FIRN_CORE_2F
FIRN_SHAPES(, 2)
FIRN_CORE(, float, 2)
#else
FIRN_SHAPES(extern, 2)
FIRN_CORE(extern, float, 2)
#endif
#if FIRN_COMPILES == FIRN_CORE_2D
FIRN_CORE(, double, 2)
#else
FIRN_CORE(extern, double, 2)
#endif
#if FIRN_COMPILES == FIRN_CORE_3F
FIRN_SHAPES(, 3)
FIRN_CORE(, float, 3)
#else
FIRN_SHAPES(extern, 3)
FIRN_CORE(extern, float, 3)
#endif
#if FIRN_COMPILES == FIRN_CORE_3D
FIRN_CORE(, double, 3)
#else
FIRN_CORE(extern, double, 3)
#endif
#if FIRN_COMPILES == FIRN_SIMULATION_2
FIRN_SIMULATION(, 2)
#else
FIRN_SIMULATION(extern, 2)
#endif
#if FIRN_COMPILES == FIRN_SIMULATION_3
FIRN_SIMULATION(, 3)
#else
FIRN_SIMULATION(extern, 3)
#endif
#undef FIRN_SIMULATION
#undef FIRN_SHAPES
#undef FIRN_CORE
#endif
