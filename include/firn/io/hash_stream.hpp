/// \file Computes the hash of an array piece by piece. The pieces may be in the memories of several processes: the
/// state of the computation is about a kilobyte, which one process sends to the next.
#pragma once

#include <firn/io/state_digest.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace firn::inline FIRN_BUILD::detail {

/// The hash of an array whose pieces are added one after the other. It equals hash_numbers() of the whole array.
class HashStream {
public:
    /// Adds the next piece of the array.
    /// \param numbers       the bytes of the piece's numbers
    /// \param number_bytes  the size of one number [bytes]
    void add(std::span<const std::byte> numbers, std::size_t number_bytes) {
        with_little_endian_bytes(numbers, number_bytes, [this](std::span<const std::byte> bytes) { hash_.add(bytes); });
    }
    /// Returns the hash of all pieces that were added.
    std::uint64_t hash() const { return hash_.hash(); }

    /// The state of the computation, for another process that runs the same program.
    using Bytes = std::array<std::byte, sizeof(BytesHash)>;
    Bytes bytes() const { return std::bit_cast<Bytes>(hash_); }
    /// Goes on from the state of another process's computation.
    void go_on_from(const Bytes& bytes) { hash_ = std::bit_cast<BytesHash>(bytes); }

private:
    BytesHash hash_;
};

}  // namespace firn::inline FIRN_BUILD::detail
