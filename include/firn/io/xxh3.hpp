/// \file XXH3, the hash function of the digests of states, with 64 bits and without a seed.
///
/// The algorithm and its constants are those of xxHash 0.8 (https://xxhash.com), written anew for firn. It gives the
/// same numbers as XXH3_64bits() of xxHash, whose licence is:
///
/// Copyright (C) 2012-2021 Yann Collet
///
/// BSD 2-Clause License (https://www.opensource.org/licenses/bsd-license.php)
///
/// Redistribution and use in source and binary forms, with or without modification, are permitted provided that the
/// following conditions are met:
///
/// * Redistributions of source code must retain the above copyright notice, this list of conditions and the following
///   disclaimer.
/// * Redistributions in binary form must reproduce the above copyright notice, this list of conditions and the
///   following disclaimer in the documentation and/or other materials provided with the distribution.
///
/// THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS AND CONTRIBUTORS "AS IS" AND ANY EXPRESS OR IMPLIED WARRANTIES,
/// INCLUDING, BUT NOT LIMITED TO, THE IMPLIED WARRANTIES OF MERCHANTABILITY AND FITNESS FOR A PARTICULAR PURPOSE ARE
/// DISCLAIMED. IN NO EVENT SHALL THE COPYRIGHT OWNER OR CONTRIBUTORS BE LIABLE FOR ANY DIRECT, INDIRECT, INCIDENTAL,
/// SPECIAL, EXEMPLARY, OR CONSEQUENTIAL DAMAGES (INCLUDING, BUT NOT LIMITED TO, PROCUREMENT OF SUBSTITUTE GOODS OR
/// SERVICES; LOSS OF USE, DATA, OR PROFITS; OR BUSINESS INTERRUPTION) HOWEVER CAUSED AND ON ANY THEORY OF LIABILITY,
/// WHETHER IN CONTRACT, STRICT LIABILITY, OR TORT (INCLUDING NEGLIGENCE OR OTHERWISE) ARISING IN ANY WAY OUT OF THE USE
/// OF THIS SOFTWARE, EVEN IF ADVISED OF THE POSSIBILITY OF SUCH DAMAGE.
#pragma once

#include <firn/core/config.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace firn::inline FIRN_BUILD::detail {

namespace xxh3 {

constexpr std::uint64_t prime32_1 = 0x9e3779b1, prime32_2 = 0x85ebca77, prime32_3 = 0xc2b2ae3d;
constexpr std::uint64_t prime64_1 = 0x9e3779b185ebca87, prime64_2 = 0xc2b2ae3d27d4eb4f, prime64_3 = 0x165667b19e3779f9,
                        prime64_4 = 0x85ebca77c2b2ae63, prime64_5 = 0x27d4eb2f165667c5;

/// The bytes that XXH3 mixes with those of the data.
alignas(64) inline constexpr unsigned char secret[192] = {
    0xb8, 0xfe, 0x6c, 0x39, 0x23, 0xa4, 0x4b, 0xbe, 0x7c, 0x01, 0x81, 0x2c, 0xf7, 0x21, 0xad, 0x1c,  //
    0xde, 0xd4, 0x6d, 0xe9, 0x83, 0x90, 0x97, 0xdb, 0x72, 0x40, 0xa4, 0xa4, 0xb7, 0xb3, 0x67, 0x1f,  //
    0xcb, 0x79, 0xe6, 0x4e, 0xcc, 0xc0, 0xe5, 0x78, 0x82, 0x5a, 0xd0, 0x7d, 0xcc, 0xff, 0x72, 0x21,  //
    0xb8, 0x08, 0x46, 0x74, 0xf7, 0x43, 0x24, 0x8e, 0xe0, 0x35, 0x90, 0xe6, 0x81, 0x3a, 0x26, 0x4c,  //
    0x3c, 0x28, 0x52, 0xbb, 0x91, 0xc3, 0x00, 0xcb, 0x88, 0xd0, 0x65, 0x8b, 0x1b, 0x53, 0x2e, 0xa3,  //
    0x71, 0x64, 0x48, 0x97, 0xa2, 0x0d, 0xf9, 0x4e, 0x38, 0x19, 0xef, 0x46, 0xa9, 0xde, 0xac, 0xd8,  //
    0xa8, 0xfa, 0x76, 0x3f, 0xe3, 0x9c, 0x34, 0x3f, 0xf9, 0xdc, 0xbb, 0xc7, 0xc7, 0x0b, 0x4f, 0x1d,  //
    0x8a, 0x51, 0xe0, 0x4b, 0xcd, 0xb4, 0x59, 0x31, 0xc8, 0x9f, 0x7e, 0xc9, 0xd9, 0x78, 0x73, 0x64,  //
    0xea, 0xc5, 0xac, 0x83, 0x34, 0xd3, 0xeb, 0xc3, 0xc5, 0x81, 0xa0, 0xff, 0xfa, 0x13, 0x63, 0xeb,  //
    0x17, 0x0d, 0xdd, 0x51, 0xb7, 0xf0, 0xda, 0x49, 0xd3, 0x16, 0x55, 0x26, 0x29, 0xd4, 0x68, 0x9e,  //
    0x2b, 0x16, 0xbe, 0x58, 0x7d, 0x47, 0xa1, 0xfc, 0x8f, 0xf8, 0xb8, 0xd1, 0x7a, 0xd0, 0x31, 0xce,  //
    0x45, 0xcb, 0x3a, 0x8f, 0x95, 0x16, 0x04, 0x28, 0xaf, 0xd7, 0xfb, 0xca, 0xbb, 0x4b, 0x40, 0x7e,
};

/// The 8 (or 4) bytes from `from` on, as a number whose lowest byte comes first.
/// @{
inline std::uint64_t read64(const void* from) {
    std::uint64_t value;
    std::memcpy(&value, from, 8);
    return std::endian::native == std::endian::little ? value : __builtin_bswap64(value);
}
inline std::uint64_t read32(const void* from) {
    std::uint32_t value;
    std::memcpy(&value, from, 4);
    return std::endian::native == std::endian::little ? value : __builtin_bswap32(value);
}
/// @}

/// Returns the upper half of the product a b of 128 bits, xor its lower half.
inline std::uint64_t folded_product(std::uint64_t a, std::uint64_t b) {
#ifdef __SIZEOF_INT128__
    __extension__ using Wide = unsigned __int128;
    const Wide product = Wide(a) * b;
    return std::uint64_t(product) ^ std::uint64_t(product >> 64);
#else
    constexpr std::uint64_t low = 0xffffffff;
    const std::uint64_t low_low = (a & low) * (b & low), high_low = (a >> 32) * (b & low);
    const std::uint64_t cross = (low_low >> 32) + (high_low & low) + (a & low) * (b >> 32);
    return ((high_low >> 32) + (cross >> 32) + (a >> 32) * (b >> 32)) ^ (cross << 32 | (low_low & low));
#endif
}

/// Spreads a change of any bit over all bits: as XXH3 does it, and as XXH64 does it.
/// @{
inline std::uint64_t spread(std::uint64_t h) {
    h = (h ^ h >> 37) * 0x165667919e3779f9;
    return h ^ h >> 32;
}
inline std::uint64_t spread_as_xxh64(std::uint64_t h) {
    h = (h ^ h >> 33) * prime64_2;
    h = (h ^ h >> 29) * prime64_3;
    return h ^ h >> 32;
}
/// @}

inline std::uint64_t of_16_bytes(const std::byte* data, std::size_t of_secret) {
    return folded_product(read64(data) ^ read64(secret + of_secret), read64(data + 8) ^ read64(secret + of_secret + 8));
}

/// Returns the hash of at most 240 bytes.
inline std::uint64_t hash_of_few(const std::byte* data, std::size_t bytes) {
    const auto of_secret = [](std::size_t at) { return read64(secret + at) ^ read64(secret + at + 8); };
    const std::byte* const end = data + bytes;
    if (bytes == 0) return spread_as_xxh64(of_secret(56));
    if (bytes < 4) {
        const auto byte = [&](std::size_t at) { return std::uint64_t(data[at]); };
        const std::uint64_t all = byte(0) << 16 | byte(bytes / 2) << 24 | byte(bytes - 1) | bytes << 8;
        return spread_as_xxh64(all ^ read32(secret) ^ read32(secret + 4));
    }
    if (bytes <= 8) {
        std::uint64_t h = (read32(end - 4) + (read32(data) << 32)) ^ of_secret(8);
        h = (h ^ std::rotl(h, 49) ^ std::rotl(h, 24)) * 0x9fb21c651e98df25;
        h = (h ^ ((h >> 35) + bytes)) * 0x9fb21c651e98df25;
        return h ^ h >> 28;
    }
    if (bytes <= 16) {
        const std::uint64_t low = read64(data) ^ of_secret(24), high = read64(end - 8) ^ of_secret(40);
        return spread(bytes + __builtin_bswap64(low) + high + folded_product(low, high));
    }
    std::uint64_t h = bytes * prime64_1;
    if (bytes <= 128) {
        for (std::size_t at = 0; 2 * at < bytes; at += 16)
            h += of_16_bytes(data + at, 2 * at) + of_16_bytes(end - at - 16, 2 * at + 16);
        return spread(h);
    }
    for (std::size_t at = 0; at < 128; at += 16) h += of_16_bytes(data + at, at);
    h = spread(h);
    for (std::size_t at = 128; at + 16 <= bytes; at += 16) h += of_16_bytes(data + at, at - 125);
    return spread(h + of_16_bytes(end - 16, 119));
}

#ifdef __SSE2__
// The compiler's vectors: g++ multiplies numbers of 64 bits where it vectorises a loop, which takes three times as
// long.
#ifdef __AVX2__
using Vector [[gnu::vector_size(32)]] = std::uint64_t;
using Halves [[gnu::vector_size(32)]] = int;
inline Vector neighbours_exchanged(Vector v) { return __builtin_shufflevector(v, v, 1, 0, 3, 2); }
#else
using Vector [[gnu::vector_size(16)]] = std::uint64_t;
using Halves [[gnu::vector_size(16)]] = int;
inline Vector neighbours_exchanged(Vector v) { return __builtin_shufflevector(v, v, 1, 0); }
#endif
/// Returns for each number of 64 bits the product of its lower and its upper half.
inline Vector product_of_halves(Vector v) {
#if defined(__AVX2__) && __has_builtin(__builtin_ia32_pmuludq256)
    return Vector(__builtin_ia32_pmuludq256(Halves(v), Halves(v >> 32)));
#elif !defined(__AVX2__) && __has_builtin(__builtin_ia32_pmuludq128)
    return Vector(__builtin_ia32_pmuludq128(Halves(v), Halves(v >> 32)));
#else
    return (v & 0xffffffff) * (v >> 32);  // clang uses the same instruction here
#endif
}
#endif

/// The hash of more than 240 bytes. They are read in stripes of 64 bytes, of which 16 are a block.
class Stripes {
public:
    static constexpr std::size_t stripe = 64, block = 16 * stripe;

    /// Adds a block after which more bytes follow.
    void add_block(const std::byte* data) {
        add(data, 16);
        for (std::size_t i = 0; i < 8; ++i)
            sums_[i] = (sums_[i] ^ sums_[i] >> 47 ^ read64(secret + 128 + 8 * i)) * prime32_1;
    }
    /// Adds the last bytes, of which there are 1 to `block`, and returns the hash of all bytes. The `stripe` bytes
    /// before the last ones must lie in memory before them.
    /// \param all  number of all bytes
    std::uint64_t hash_with_last(const std::byte* data, std::size_t bytes, std::uint64_t all) const {
        Stripes whole = *this;
        whole.add(data, (bytes - 1) / stripe);
        whole.add(data + bytes - stripe, 1, 121);
        std::uint64_t h = all * prime64_1;
        for (std::size_t i = 0; i < 8; i += 2)
            h += folded_product(whole.sums_[i] ^ read64(secret + 11 + 8 * i),
                                whole.sums_[i + 1] ^ read64(secret + 19 + 8 * i));
        return spread(h);
    }

private:
    /// Adds `count` stripes. From one to the next, the part of the secret that is used begins 8 bytes later.
    void add(const std::byte* data, std::size_t count, std::size_t of_secret = 0) {
#ifdef __SSE2__
        constexpr std::size_t vectors = stripe / sizeof(Vector);
        Vector sums[vectors];
        std::memcpy(sums, sums_, stripe);
        for (; count > 0; --count, data += stripe, of_secret += 8)
            for (std::size_t i = 0; i < vectors; ++i) {
                Vector of_data, key;
                std::memcpy(&of_data, data + sizeof(Vector) * i, sizeof(Vector));
                std::memcpy(&key, secret + of_secret + sizeof(Vector) * i, sizeof(Vector));
                key ^= of_data;
                sums[i] += neighbours_exchanged(of_data) + product_of_halves(key);
            }
        std::memcpy(sums_, sums, stripe);
#else
        for (; count > 0; --count, data += stripe, of_secret += 8)
            for (std::size_t i = 0; i < 8; ++i) {
                const std::uint64_t of_data = read64(data + 8 * i), key = of_data ^ read64(secret + of_secret + 8 * i);
                sums_[i ^ 1] += of_data;
                sums_[i] += (key & 0xffffffff) * (key >> 32);
            }
#endif
    }

    std::uint64_t sums_[8] = {prime32_3, prime64_1, prime64_2, prime64_3, prime64_4, prime32_2, prime64_5, prime32_1};
};

}  // namespace xxh3

/// Returns the hash of these bytes.
[[gnu::noinline]] inline std::uint64_t hash_bytes(std::span<const std::byte> bytes) {
    if (bytes.size() <= 240) return xxh3::hash_of_few(bytes.data(), bytes.size());
    xxh3::Stripes stripes;
    const std::byte* at = bytes.data();
    std::size_t left = bytes.size();
    for (; left > xxh3::Stripes::block; at += xxh3::Stripes::block, left -= xxh3::Stripes::block) stripes.add_block(at);
    return stripes.hash_with_last(at, left, bytes.size());
}

/// The hash of bytes that are added piece by piece. It equals hash_bytes() of the whole. All that it knows is in its
/// own bytes, so that another process can go on from a copy of them.
class BytesHash {
public:
    void add(std::span<const std::byte> bytes) {
        count_ += bytes.size();
        while (!bytes.empty()) {
            if (waiting_ == block) {
                stripes_.add_block(bytes_ + stripe);
                std::memcpy(bytes_, bytes_ + block, stripe);
                waiting_ = 0;
            }
            const std::size_t now = std::min(bytes.size(), block - waiting_);
            std::memcpy(bytes_ + stripe + waiting_, bytes.data(), now);
            waiting_ += now;
            bytes = bytes.subspan(now);
        }
    }
    std::uint64_t hash() const {
        const std::byte* const waiting = bytes_ + stripe;
        return count_ <= 240 ? xxh3::hash_of_few(waiting, waiting_)
                             : stripes_.hash_with_last(waiting, waiting_, count_);
    }

private:
    static constexpr std::size_t stripe = xxh3::Stripes::stripe, block = xxh3::Stripes::block;

    xxh3::Stripes stripes_;
    std::uint64_t count_ = 0, waiting_ = 0;
    /// The last stripe of what is in `stripes_`, and after it the bytes that wait until more bytes follow.
    std::byte bytes_[stripe + block] = {};
};

}  // namespace firn::inline FIRN_BUILD::detail
