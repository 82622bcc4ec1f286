/// \file Copies a field of many particles at once. What a copy needs to know of the field or of a block is found once.
#pragma once

#include <firn/data/particle_store.hpp>

#include <array>
#include <concepts>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// Copies the positions x [m] of the particles in these slots. \see ParticleStore::exact_position
/// \param to  memory for D numbers of each particle
template <std::floating_point T, std::floating_point S, int D>
void read_positions(const ParticleStore<S, D>& particles, std::span<const std::uint32_t> slots, T* to) {
    const PlacesOfParticles<S> places = particles.places();
    const Domain<D>& domain = particles.domain();
    const int stride = copy_stride(domain);
    std::uint32_t of = std::numeric_limits<std::uint32_t>::max();
    BlockCoordinate<D> block{};
    for (const std::uint32_t slot : slots) {
        if (places.block[slot] != of) {
            of = places.block[slot];
            block = block_of_key<D>(places.keys[of]);
            if (places.grouped) block[0] = along_in_domain(block[0], stride);
        }
        const S* const place = places.places + slot / pack_size * D * pack_size + slot % pack_size;
        for (int a = 0; a < D; ++a)
            *to++ = T(into_domain(domain, a, position_along(domain, a, block[std::size_t(a)], place[a * pack_size])));
    }
}

/// Copies a field of the particles in these slots: of each, what ParticleStore::get() tells.
/// \param field  index of the field in the table
/// \param to     memory for FieldInfo::components_in_state() numbers of each particle
template <std::floating_point T, std::floating_point S, int D>
void read_field(const ParticleStore<S, D>& particles, std::size_t field, std::span<const std::uint32_t> slots, T* to) {
    constexpr int most = 9;
    const FieldInfo& info = particles.table()[field];
    const int count = info.components_in_state(D);
    std::array<std::uint32_t, most> offset{};
    std::array<bool, most> less_one{};
    for (int k = 0; k < count; ++k) {
        offset[std::size_t(k)] = std::uint32_t(info.component_of(D, k) * pack_size);
        less_one[std::size_t(k)] = info.is_less_one(D, k);
    }
    const auto copy = [&](auto components, auto has_ones) {
        for (const std::uint32_t slot : slots) {
            const S* const from = particles.numbers_of(field, slot);
            for (std::size_t k = 0; k < std::size_t(components); ++k) {
                const S stored = from[offset[k]];
                to[k] = T(has_ones && less_one[k] ? S(1) + stored : stored);
            }
            to += components;
        }
    };
    // The usual numbers of components as constants.
    const auto copy_of = [&](auto components) {
        info.less_one ? copy(components, std::true_type{}) : copy(components, std::false_type{});
    };
    if (count == 1)
        copy_of(std::integral_constant<int, 1>{});
    else if (count == D)
        copy_of(std::integral_constant<int, D>{});
    else if (count == D * D)
        copy_of(std::integral_constant<int, D * D>{});
    else
        copy_of(count);
}

}  // namespace firn::inline FIRN_BUILD
