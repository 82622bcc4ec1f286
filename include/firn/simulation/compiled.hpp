/// \file Templates that a program may compile in only one of its files, or link from the library firn::compiled.
#pragma once

#include <firn/simulation.hpp>

namespace firn::inline FIRN_BUILD {

// Functions that take long to compile are defined outside of the class, so that they are not inline. A file that
// declares the simulation as `extern template class` does not compile these functions again.

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law>::step() {
    step(gravity);
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law>::advance(double duration) {
    advance(duration, gravity);
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law>
void Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law>::prepare() {
    if (any_set([](const auto& set) { return !set.readiness.is(Readiness::changed); }))
        detail::throw_spoiled(now_.steps);
    if (now_.steps == 0) for_sets([&](auto& set) { set.give(now_.time, workers(), ranks().share()); });
    if (!any_set([](const auto& set) { return !set.readiness.is(Readiness::prepared); })) return;
    double fastest = 0;
    parallel_region(workers(), [&] {
        for_sets([&](auto& set) {
            if (!set.readiness.is(Readiness::prepared)) prepare(set);
        });
        ranks().join_reports(sets_);
        for_sets([&](const auto& set) {
            if (!(set.report.signal_speed <= fastest)) fastest = set.report.signal_speed;
        });
    });
    if (!std::isfinite(fastest) || !(fastest > 0 || detail::may_have_particles(sets_, ranks()))) {
        for_sets([](auto& set) { set.readiness.unprepare(); });
        detail::throw_wrong_signal(fastest);
    }
    activate();
}

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law>
Body Simulation<D, Material, Transfer, Force, Kernel, Execution, Boundary, Volume, Law>::add_to(
    std::size_t number, const Samples<D>& samples, double density, const Vec<double, D>& velocity) {
    Body body;
    std::size_t i = 0;
    for_sets([&](auto& set) {
        body = i++ == number ? set.add(samples, density, velocity, workers(), ranks().share()) : body;
    });
    warn_of_spacing(samples);
    return body;
}

}  // namespace firn::inline FIRN_BUILD

#ifdef FIRN_COMPILED
/// The templates of the library firn::compiled: the common simulations, the sampling of shapes, and templates that
/// other simulations also use. A source file of the library instantiates them; it defines FIRN_COMPILES as the
/// dimension. All other files declare the templates `extern`.
#define FIRN_TEMPLATES(where, D)                                                                                 \
    namespace firn {                                                                                             \
    where template class ParticleStore<float, D>;                                                                \
    where template class Particles<float, D, ElasticState<float, D>>;                                            \
    where template class SparseGrid<float, D>;                                                                   \
    where template class BlockSort<D>;                                                                           \
    where template BlockPartition<D> arrange(const std::vector<BlockRange<D>>&, int, int);                       \
    where template BlockPartition<D> detail::partition_places(const PlacesOfParticles<float>&, const Domain<D>&, \
                                                              double, int, int, std::byte*);                     \
    where template class Simulation<D>;                                                                          \
    where template Samples<D> sample_box(const Vec<double, D>&, const Vec<double, D>&, const SamplingOptions&);  \
    where template Samples<D> sample_sphere(const Vec<double, D>&, double, const SamplingOptions&);              \
    where template std::vector<Vec<double, D>> poisson_disk_points(const Vec<double, D>&, const Vec<double, D>&, \
                                                                   double, std::uint64_t, double, int);          \
    }
namespace firn::inline FIRN_BUILD::detail {
/// A function that makes the linker report different options. Its name has the build in it (core/build.hpp), and it is
/// defined for the build of the library only: compile the program and the library with the same compiler and options.
void firn_compiled_has_the_same_options();
#if FIRN_COMPILES == 3
void firn_compiled_has_the_same_options() {}
#elif !defined(FIRN_COMPILES)
[[gnu::used]] inline void (*const of_library)() = firn_compiled_has_the_same_options;
#endif
}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_COMPILES == 2
FIRN_TEMPLATES(, 2)
#else
FIRN_TEMPLATES(extern, 2)
#endif
#if FIRN_COMPILES == 3
FIRN_TEMPLATES(, 3)
#else
FIRN_TEMPLATES(extern, 3)
#endif
#undef FIRN_TEMPLATES
#endif
