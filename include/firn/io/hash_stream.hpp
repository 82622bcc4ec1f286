/// \file Computes the hash of an array piece by piece. The pieces may be in the memories of several processes: the
/// state of the computation is a few hundred bytes, which one process sends to the next.
#pragma once

#include <firn/io/state_digest.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace firn::inline FIRN_BUILD::detail {

/// The hash of an array whose pieces are added one after the other. It equals hash_numbers() of the whole array.
class HashStream {
public:
    HashStream() { firn_xxhash::reset(state_); }

    /// Adds the next piece of the array.
    /// \param numbers       the bytes of the piece's numbers
    /// \param number_bytes  the size of one number [bytes]
    void add(std::span<const std::byte> numbers, std::size_t number_bytes) {
        with_little_endian_bytes(numbers, number_bytes, [this](std::span<const std::byte> bytes) {
            if (!bytes.empty()) firn_xxhash::update(state_, bytes.data(), bytes.size());
        });
    }
    /// Returns the hash of all pieces that were added.
    std::uint64_t hash() const { return firn_xxhash::digest(state_); }

    /// The state of the computation, for another process that runs the same program.
    using Bytes = std::array<std::byte, sizeof(firn_xxhash::state)>;
    Bytes bytes() const {
        Bytes copy;
        std::memcpy(copy.data(), &state_, sizeof state_);
        return copy;
    }
    /// Goes on from the state of another process's computation.
    void go_on_from(const Bytes& bytes) {
        firn_xxhash::state here;
        firn_xxhash::reset(here);
        std::memcpy(&state_, bytes.data(), sizeof state_);
        state_.extSecret = here.extSecret;  // an address, which differs between processes
    }

private:
    firn_xxhash::state state_{};
};

}  // namespace firn::inline FIRN_BUILD::detail
