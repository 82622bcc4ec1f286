/// \file Small sets of particles for tests, and what is compared about them.
#pragma once

#include <firn/firn.hpp>

#include <cstring>
#include <map>
#include <vector>

namespace scenes {

/// A number in [0, 1) that depends only on its index.
inline double noise(std::uint64_t index) {
    std::uint64_t z = (index + 1) * 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/// Particles in arrays as a foreign program may own them: deformed, moving and turning at random.
template <class S, int D>
struct RandomCloud {
    std::vector<S> x, v, C, F, stress, mass, volume;
    firn::Domain<D> domain;

    explicit RandomCloud(std::size_t count, std::uint64_t seed = 1) {
        domain.lower = firn::Vec<double, D>::filled(-0.25);
        domain.upper = firn::Vec<double, D>::filled(0.75);
        domain.cell_size = 0.05;
        std::uint64_t n = seed * 1'000'003;
        const auto number = [&](double from, double to) { return S(from + (to - from) * noise(n++)); };
        for (std::size_t p = 0; p < count; ++p) {
            for (int a = 0; a < D; ++a) x.push_back(number(-0.2, 0.7));
            for (int a = 0; a < D; ++a) v.push_back(number(-2, 2));
            for (int k = 0; k < D * D; ++k) C.push_back(number(-5, 5));
            for (int k = 0; k < D * D; ++k) F.push_back(S(k % (D + 1) == 0) + number(-0.2, 0.2));
            for (int k = 0; k < D * D; ++k) stress.push_back(S(0));
            for (int i = 0; i < D; ++i)
                for (int j = i; j < D; ++j)
                    stress[p * D * D + std::size_t(i * D + j)] = stress[p * D * D + std::size_t(j * D + i)] =
                        number(-2e3, 2e3);
            mass.push_back(number(0.5, 1.5));
            volume.push_back(number(0.5e-3, 1.5e-3));
        }
    }

    std::size_t size() const { return mass.size(); }

    firn::ForeignParticles<S, D> view() {
        using Span = firn::StridedSpan<S>;
        return {Span::template vectors<D>(x.data()),
                Span::template vectors<D>(v.data()),
                Span::template matrices<D>(C.data(), true),
                firn::symmetric_matrices<D>(stress.data()),
                Span::scalars(mass.data()),
                Span::scalars(volume.data()),
                {Span::template matrices<D>(F.data(), true)}};
    }
};

/// Every kind of group is worked through in its own way.
enum class Kind { dense, cube, spray };

/// So many that a RandomCloud has groups of a kind.
template <int D>
std::size_t particles_of(Kind kind) {
    if (kind == Kind::dense) return 4000;
    if (kind == Kind::cube) return D == 2 ? 450 : 2200;
    return D == 2 ? 60 : 200;
}
template <int D>
bool has(const firn::BlockPartition<D>& partition, Kind kind) {
    return std::any_of(partition.groups.begin(), partition.groups.end(), [&](const firn::BlockGroup& group) {
        return kind == (firn::is_spray<D>(group) ? Kind::spray : group.sparse ? Kind::cube : Kind::dense);
    });
}

/// Two blocks of matter that fly at each other and turn: contact, drift over block borders, re-sorting.
template <int D, class Simulation>
void add_two_blocks(Simulation& simulation, double side = 0.3, double spacing = 1.0 / 64) {
    using V = firn::Vec<double, D>;
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered, .jitter = 0.1};
    V low = V::filled(0.12), velocity = V::filled(0.4);
    velocity[0] = 1.5;
    simulation.add(firn::sample_box<D>(low, low + V::filled(side), filling), 1000, velocity);
    low = V::filled(0.4);
    low[0] = 0.5;
    velocity = -velocity;
    simulation.add(firn::sample_box<D>(low, low + V::filled(side), filling), 1000, velocity);
}

/// Moves particles to other slots, at random, each with all that it has: as if they had been added in another order.
template <class S, int D, class State>
void shuffle(firn::Particles<S, D, State>& particles, std::uint64_t seed) {
    const auto random_order = [&](auto& list) {
        for (std::size_t i = list.size(); i > 1; --i)
            std::swap(list[i - 1], list[std::size_t(noise(seed++) * double(i))]);
    };
    std::map<firn::BlockCoordinate<D>, std::vector<std::uint32_t>> slots_of;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) slots_of[particles.block(slot)].push_back(std::uint32_t(slot));
    std::vector<firn::BlockCoordinate<D>> blocks;
    for (const auto& [block, slots] : slots_of) blocks.push_back(block);
    random_order(blocks);
    firn::BlockPartition<D> partition;
    for (const auto& block : blocks) {
        std::vector<std::uint32_t>& slots = slots_of[block];
        random_order(slots);
        const std::size_t first = partition.order.size();
        partition.ranges.push_back({block, first, slots.size()});
        partition.groups.push_back({std::uint32_t(partition.groups.size()), 1, first, slots.size(), false});
        partition.order.insert(partition.order.end(), slots.begin(), slots.end());
        while (partition.order.size() % firn::pack_size != 0) partition.order.push_back(firn::no_particle);
    }
    particles.reorder(partition, 1);
}

/// FNV-1a over the bits of numbers.
struct Hash {
    std::uint64_t value = 0xcbf29ce484222325ull;

    template <class T>
    void add(const T* numbers, std::size_t count) {
        unsigned char bytes[sizeof(T) * 9];
        std::memcpy(bytes, numbers, count * sizeof(T));
        for (std::size_t i = 0; i < count * sizeof(T); ++i) value = (value ^ bytes[i]) * 0x100000001b3ull;
    }
};

/// The hash of everything that a particle has, in the order of ids.
template <class S, int D, class State>
std::uint64_t hash(const firn::Particles<S, D, State>& particles) {
    std::vector<std::size_t> slot_of(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) slot_of[particles.id(slot)] = slot;
    Hash all;
    for (const std::size_t slot : slot_of) {
        const auto x = particles.position(slot), v = particles.velocity(slot);
        const auto C = particles.affine(slot), H = displacement_gradient(particles.state(slot).F);
        all.add(x.v, std::size_t(D));
        all.add(v.v, std::size_t(D));
        all.add(C.m, std::size_t(D * D));
        all.add(H.m, std::size_t(D * D));
    }
    return all.value;
}
template <class Simulation>
std::uint64_t hash(const Simulation& simulation) {
    return hash(simulation.particles());
}

}  // namespace scenes
