/// \file Sorts particles by the blocks and cells of their base nodes. The particles are firn's own or those of another
/// program.
#pragma once

#include <firn/data/check_particles.hpp>
#include <firn/data/kernel_facts.hpp>
#include <firn/data/particle_store.hpp>
#include <firn/sort/block_sort.hpp>

#include <memory>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Checks that the pattern of the blocks' colours continues without a break across the ends of periodic axes.
/// \throws parameter_error  if the number of blocks along a periodic axis is no multiple of `colours`
template <int D>
void check_periods(const Domain<D>& domain, int colours, int support) {
    for (int a = 0; a < D; ++a)
        if (block_period(domain, a) % colours != 0)
            throw parameter_error(sentence("The domain has ", domain.cells(a), " cells along the periodic axis ", a,
                                           "; with a kernel of support ", support,
                                           " their number must be a multiple of ", periodic_multiple * colours, "."));
}

/// Returns the partition of firn's own particles: their order by block, cell and id. The function is the same for all
/// materials and kernels.
/// \param room  scratch memory of `BlockSort::room` bytes per slot
template <std::floating_point S, int D>
BlockPartition<D> partition_places(const PlacesOfParticles<S>& particles, const Domain<D>& domain,
                                   const KernelFacts& kernel, int threads, std::byte* room) {
    check_periods(domain, kernel.colours, kernel.support);
    BlockSort<D> sort(particles.slots, particles.id, threads, room);
    const bool periodic = is_periodic(domain);
    sort.look([&](std::size_t i) { return particles.is_particle(i); },
              [&](std::size_t first, std::size_t count, BlockCells& cells) {
                  using P = native_pack<S>;
                  const P shift = P(S(kernel.base_shift));
                  S base[D][pack_size];
                  const S* places = particles.places + first * D;
                  for (int a = 0; a < D; ++a)
                      for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes)
                          base_node(P::load(places + a * pack_size + lane), shift).store(base[a] + lane);
                  for (std::size_t l = 0; l < pack_size; ++l)
                      cells.origin[l] =
                          l < count && particles.is_particle(first + l) ? particles.block_key(first + l) : 0;
                  find_cells<S, D>(base, cells);
                  if (periodic)
                      for (std::uint64_t& block : cells.block) block = wrapped_key(domain, block);
              });
    BlockPartition<D> partition = sort.partition(kernel.colours);
    if (particles.grouped) partition.copy_stride = copy_stride(domain);
    return partition;
}

}  // namespace detail

/// Returns the partition of firn's own particles: their order by block, cell and id. No particle is moved.
/// \param threads  number of threads; 0: thread_count() chooses
/// \param room     scratch memory of `BlockSort::room` bytes per slot
/// \throws parameter_error  if the number of cells along a periodic axis is no multiple of 16 (with the cubic
///                          kernel: of 48)
template <class Kernel, std::floating_point S, int D>
BlockPartition<D> partition_particles(const ParticleStore<S, D>& particles, int threads, std::byte* room) {
    return detail::partition_places(particles.places(), particles.domain(), facts_of<Kernel>(), threads, room);
}

/// Returns the partition of firn's own particles: their order by block, cell and id. No particle is moved. The function
/// allocates the scratch memory itself.
/// \param threads  number of threads; 0: thread_count() chooses
/// \throws parameter_error  if the number of cells along a periodic axis is no multiple of 16 (with the cubic
///                          kernel: of 48)
template <class Kernel, std::floating_point S, int D>
BlockPartition<D> partition_particles(const ParticleStore<S, D>& particles, int threads = 0) {
    const auto room = std::make_unique_for_overwrite<std::byte[]>(particles.slots() * BlockSort<D>::room);
    return partition_particles<Kernel>(particles, threads, room.get());
}

/// Returns the partition of another program's particles: their order by block, cell and index. No particle is moved.
/// \param count    number of particles
/// \param threads  number of threads; 0: thread_count() chooses
/// \throws particle_error   if a position is not finite or outside the domain, or if the view has masses and one of
///                          them is not positive and finite; the message names the first three such particles by index
/// \throws parameter_error  if the domain is periodic, or if the domain does not pass check()
template <class Kernel, std::floating_point S, int D, class State>
BlockPartition<D> partition_particles(const ParticleView<S, D, StridedSpan<S>, State>& view, std::size_t count,
                                      const Domain<D>& domain, int threads = 0) {
    check(domain);
    if (is_periodic(domain))
        throw parameter_error(
            "The domain is periodic; arrays of another program cannot be used with it. Use firn's Particles or "
            "Simulation.");
    check_positions<S, D>(count, domain, [&](std::size_t i, int a) { return view.position.particle(i, a); });
    if (view.mass.data) check_masses<S>(count, [&](std::size_t i) { return view.mass.particle(i, 0); });
    const S per_cell = S(1 / domain.cell_size);
    const auto room = std::make_unique_for_overwrite<std::byte[]>(count * BlockSort<D>::room);
    BlockSort<D> sort(count, nullptr, threads, room.get());
    sort.look([](std::size_t) { return true; },
              [&](std::size_t first, std::size_t used, BlockCells& cells) {
                  S base[D][pack_size] = {};
                  std::fill_n(cells.origin, pack_size, block_key<D>({}));
                  for (std::size_t l = 0; l < used; ++l)
                      for (int a = 0; a < D; ++a)
                          base[a][l] =
                              base_node<Kernel>((view.position.particle(first + l, a) - S(domain.lower[a])) * per_cell);
                  find_cells<S, D>(base, cells);
              });
    return sort.partition(colours_along_axis<Kernel>);
}

/// Sorts firn's own particles by block, cell and id: moves the particles into this order and returns their partition.
/// \param kernel   facts_of<Kernel>()
/// \param threads  number of threads; 0: thread_count() chooses
/// \throws parameter_error  if the number of cells along a periodic axis is no multiple of 16 (with the cubic
///                          kernel: of 48)
template <std::floating_point S, int D>
BlockPartition<D> sort_particles(const KernelFacts& kernel, ParticleStore<S, D>& particles, int threads) {
    static_assert(D * D * sizeof(S) >= BlockSort<D>::room);
    const int workers = thread_count(threads);
    BlockPartition<D> partition;
    parallel_region(workers, [&] {
        partition = detail::partition_places(particles.places(), particles.domain(), kernel, workers, particles.room());
        particles.reorder(partition, workers);
    });
    return partition;
}
/// As sort_particles() with the facts about a kernel.
template <class Kernel, std::floating_point S, int D>
BlockPartition<D> sort_particles(ParticleStore<S, D>& particles, int threads = 0) {
    return sort_particles(facts_of<Kernel>(), particles, threads);
}

}  // namespace firn::inline FIRN_BUILD
