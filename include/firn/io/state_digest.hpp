/// \file Computes a 64-bit digest (checksum) of a state. With the digest, a reader detects whether a bit of the state
/// has changed since the state was written.
#pragma once

#include <firn/io/state.hpp>
#include <firn/io/state_outline.hpp>
#include <firn/io/xxh3.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Calls f(bytes) with numbers as little-endian bytes, so that a hash of them does not depend on the byte order of the
/// machine, and returns the result of the call.
/// \param numbers       the bytes of the numbers, in the byte order `Order`
/// \param number_bytes  the size of one number [bytes]
template <std::endian Order = std::endian::native, class F>
auto with_little_endian_bytes(std::span<const std::byte> numbers, std::size_t number_bytes, const F& f) {
    if (Order == std::endian::little || number_bytes == 1) return f(numbers);
    std::vector<std::byte> turned(numbers.begin(), numbers.end());
    for (std::size_t at = 0; at < turned.size(); at += number_bytes)
        std::reverse(turned.begin() + std::ptrdiff_t(at), turned.begin() + std::ptrdiff_t(at + number_bytes));
    return f(std::span<const std::byte>(turned));
}

/// Returns the hash of numbers, as little-endian bytes.
template <std::endian Order = std::endian::native>
std::uint64_t hash_numbers(std::span<const std::byte> numbers, std::size_t number_bytes) {
    return with_little_endian_bytes<Order>(numbers, number_bytes, hash_bytes);
}

/// A sequence of bytes that is built from texts and numbers, and the hash of this sequence. The length of each text
/// comes before the text, so that different texts and numbers never give the same bytes.
class HashedRecord {
public:
    [[gnu::noinline]] HashedRecord& add(std::uint64_t number) {
        char bytes[8];
        for (int i = 0; i < 8; ++i) bytes[i] = char(number >> (8 * i));
        bytes_.append(bytes, 8);
        return *this;
    }
    HashedRecord& add(std::string_view text) {
        add(text.size());
        bytes_ += text;
        return *this;
    }
    HashedRecord& add_numbers(const StateArray& array) {
        return add(array.count).add(array.is_here() ? hash_numbers(array.bytes(), bytes_of(array.kind)) : array.hash);
    }
    std::uint64_t hash() const { return hash_bytes(std::as_bytes(std::span(bytes_))); }

private:
    std::string bytes_;
};

/// The hashes of items, added up, because the sum does not depend on the order of the items. If two items exchange
/// their values, the sum changes, because the hash of an item includes its name, and the names differ.
struct SumOfHashes {
    std::uint64_t count = 0, sum = 0;

    void add(const HashedRecord& item) { ++count, sum += item.hash(); }
};

/// Returns the digest of the state that has this outline. Arrays that are elsewhere must have their hashes.
/// \param holds  holds(name) says whether the field `name` is included
inline std::uint64_t digest_of(const StateOutline& state, const std::function<bool(std::string_view)>& holds) {
    HashedRecord whole;
    whole.add("firn state").add(bytes_of(state.scalar)).add(std::uint64_t(state.dimension)).add(state.step);
    whole.add(std::bit_cast<std::uint64_t>(state.time)).add(std::bit_cast<std::uint64_t>(state.last_time_step));
    whole.add_numbers(state.id).add_numbers(state.body).add_numbers(state.facets);

    SumOfHashes fields, parameters, attributes, tables;
    for (const auto& f : state.fields)
        if (holds(f.name))
            fields.add(HashedRecord().add(f.name).add(f.unit).add(std::uint64_t(f.components)).add_numbers(f.values));
    for (const StateParameter& p : state.parameters)
        parameters.add(HashedRecord().add(p.group).add(p.name).add(p.unit).add_numbers(p.values));
    for (const StateAttribute& a : state.attributes) attributes.add(HashedRecord().add(a.name).add(a.value));
    for (const auto& t : state.tables)
        tables.add(HashedRecord().add(t.name).add(std::uint64_t(t.columns)).add_numbers(t.values));
    for (const SumOfHashes& items : {fields, parameters, attributes, tables}) whole.add(items.count).add(items.sum);
    return whole.hash();
}

}  // namespace detail

/// Returns the digest of a state. Of the state's fields, only those that `holds` selects are included. The digest
/// depends on the precision and on every bit of names, units, texts, numbers of components, values, dimension, time and
/// number of steps. So the digest differs between −0 and 0, and between NaNs with different bits. The digest does not
/// depend on the order of fields, parameters, attributes and tables. Equal states have the same digest on all machines.
///
/// The hash function is XXH3 of xxHash 0.8. An accidental change of the state is missed with a probability of 2⁻⁶⁴. The
/// digest does not protect against deliberate changes. Computing the digest takes about as long as reading the state
/// from memory.
/// \param holds  a function bool(std::string_view name) that returns whether the field `name` is included
template <state_scalar S, class Holds>
[[nodiscard]] std::uint64_t digest(const State<S>& state, const Holds& holds) {
    return detail::digest_of(detail::StateOutline(state), std::cref(holds));
}

/// Returns the digest of a state, with all fields included.
template <state_scalar S>
[[nodiscard]] std::uint64_t digest(const State<S>& state) {
    return digest(state, [](std::string_view) { return true; });
}

}  // namespace firn::inline FIRN_BUILD
