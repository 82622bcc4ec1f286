/// \file The memory of all fields of particles. All fields share one allocation.
#pragma once

#include <firn/data/aligned.hpp>
#include <firn/data/field.hpp>
#include <firn/data/field_info.hpp>

#include <algorithm>
#include <cstring>

namespace firn::inline FIRN_BUILD {

/// The order in which particles are stored in memory.
enum class SlotOrder : std::uint8_t {
    sorted,  ///< sorted by block and cell, in packs: [pack][component][lane]
    by_id    ///< in the order in which particles were added: [slot][component]
};

/// The memory of all fields of all particles, one field after the other. The class only moves bytes, so it depends
/// neither on the material nor on the floating-point type.
///
/// With SlotOrder::sorted, the memory also has a gap as large as the widest field (the field with most bytes per slot).
/// permute() moves the field beside the gap into the gap. The memory that this field leaves is the gap for the next
/// field, and so on, until the gap has reached the other end of the memory. So no second copy of all fields is needed,
/// and nothing is allocated as long as the memory has enough slots.
class FieldMemory {
public:
    FieldMemory() = default;  ///< Makes a memory of no fields.
    /// Makes a memory without slots.
    /// \param table          the fields
    /// \param dimension      dimension of space: 2 or 3
    /// \param bytes_of_real  size of a number of type FieldNumber::real [bytes]
    /// \param order          order in which particles are stored
    FieldMemory(const FieldTable& table, int dimension, std::size_t bytes_of_real, SlotOrder order) : order_(order) {
        for (const FieldInfo& info : table) {
            const std::size_t bytes = info.number == FieldNumber::real     ? bytes_of_real
                                      : info.number == FieldNumber::uint32 ? sizeof(std::uint32_t)
                                                                           : sizeof(double);
            fields_.push_back({std::size_t(info.components(dimension)), bytes, 0});
            width_ += fields_.back().bytes_of_slot();
            widest_ = std::max(widest_, fields_.back().bytes_of_slot());
        }
        if (order == SlotOrder::by_id) widest_ = 0;
    }
    /// Copies the fields, on as many threads as have sorted the particles or made room for them. The gap is not copied.
    /// @{
    FieldMemory(const FieldMemory& other) { *this = other; }
    FieldMemory& operator=(const FieldMemory& other);
    /// @}
    FieldMemory(FieldMemory&&) = default;             ///< Takes the memory over.
    FieldMemory& operator=(FieldMemory&&) = default;  ///< Takes the memory over.

    /// Takes the fields and the layout of another memory, with arbitrary numbers.
    void make_like(const FieldMemory& other);

    /// Number of slots.
    std::size_t slots() const { return slots_; }
    /// Number of components of a field. \param field  index of the field in the table
    int components(std::size_t field) const { return int(fields_[field].components); }

    /// \name All numbers of a field
    /// @{

    /// Returns the address of a field's first number. \tparam T  type of the field's numbers
    template <class T>
    T* numbers(std::size_t field) {
        return reinterpret_cast<T*>(memory_.data() + fields_[field].offset);
    }
    template <class T>
    const T* numbers(std::size_t field) const {
        return reinterpret_cast<const T*>(memory_.data() + fields_[field].offset);
    }
    /// @}

    /// \name One component
    /// @{

    /// Returns a reference to one component of a field of the particle in a slot. \tparam T  type of the field's
    /// numbers
    template <class T>
    T& at(std::size_t field, std::size_t slot, int component) {
        return numbers<T>(field)[index(field, slot, component)];
    }
    template <class T>
    const T& at(std::size_t field, std::size_t slot, int component) const {
        return numbers<T>(field)[index(field, slot, component)];
    }

    /// @}

    /// Returns the address of the gap: scratch memory as large as the widest field. The gap may be used until permute()
    /// or grow() is called.
    std::byte* room() { return memory_.data() + (room_at_end_ ? end_of_fields() : 0); }
    /// Size of the allocated memory [bytes].
    std::size_t bytes() const { return memory_.capacity(); }
    /// Size of the memory that this many slots need [bytes].
    std::size_t bytes_for(std::size_t slots) const { return slots * (width_ + widest_); }

    /// Calls f(array, first, count) for the array that holds the numbers of all fields: in `count` entries from entry
    /// `first` on, without the gap. Where each field lies does not depend on what f does to the array.
    template <class F>
    void for_arrays(const F& f) {
        const std::size_t first = fields_.empty() ? 0 : fields_.front().offset;
        f(memory_, first, end_of_fields() - first);
    }

    /// Increases the number of slots. All numbers in new slots are zero. Each worker is the first to write to its part
    /// of the new memory.
    /// \param slots  the new number of slots, a multiple of pack_size
    void grow(std::size_t slots, int workers);

    /// Sorts the particles: moves the particle in slot order[i] to slot i, for all i. If order[i] is no_particle, slot
    /// i gets arbitrary numbers. Use permute() only with SlotOrder::sorted.
    /// \param spare  number of slots behind those of `order`, which get arbitrary numbers; a multiple of pack_size
    /// \tparam Bits  an unsigned integer type of the size of one number; the numbers of all fields must have this size
    template <class Bits>
    void permute(const aligned_vector<std::uint32_t>& order, int workers, std::size_t spare = 0) {
        workers_ = workers;
        const std::size_t slots = order.size() + spare;
        if (memory_.size() < bytes_for(slots)) grow(slots + slots / 64 / pack_size * pack_size, workers);
        slots_ = slots;
        const std::size_t count = fields_.size();
        const bool to_the_end = room_at_end_;
        std::size_t end =
            to_the_end ? memory_.size() : 0;  // offset in memory_ where the moved fields meet the gap [bytes]
        for (std::size_t i = 0; i < count; ++i) {
            Field& field = fields_[to_the_end ? count - 1 - i : i];
            const std::size_t bytes = slots_ * field.bytes_of_slot();
            const std::size_t to = to_the_end ? end - bytes : end;
            move<Bits>(field, order, memory_.data() + to, workers);
            field.offset = to;
            end = to_the_end ? to : to + bytes;
        }
        room_at_end_ = !to_the_end;
    }

    /// Copies all fields of a particle from one slot to another. Use copy() only with SlotOrder::by_id.
    void copy(std::size_t from, std::size_t to) {
        for (const Field& field : fields_) {
            std::byte* const numbers = memory_.data() + field.offset;
            std::memcpy(numbers + to * field.bytes_of_slot(), numbers + from * field.bytes_of_slot(),
                        field.bytes_of_slot());
        }
    }

private:
    struct Field {
        std::size_t components, bytes;  // number of components; size of one number [bytes]
        std::size_t offset;             // offset of the field's first number in memory_ [bytes]

        std::size_t bytes_of_slot() const { return components * bytes; }
    };
    static constexpr std::size_t packs_at_once = 64;

    FieldMemory(SlotOrder order, std::vector<Field> fields, std::size_t width, std::size_t widest)
        : order_(order), fields_(std::move(fields)), width_(width), widest_(widest) {}

    static std::size_t place(std::size_t slot, std::size_t components) {
        return slot / pack_size * (components * pack_size) + slot % pack_size;
    }
    std::size_t index(std::size_t field, std::size_t slot, int component) const {
        const std::size_t components = fields_[field].components;
        return order_ == SlotOrder::sorted ? place(slot, components) + std::size_t(component * pack_size)
                                           : slot * components + std::size_t(component);
    }
    std::size_t end_of_fields() const {
        return fields_.empty() ? 0 : fields_.back().offset + slots_ * fields_.back().bytes_of_slot();
    }

    /// Does the work of grow() if the memory is large enough: moves the fields apart, into the gap.
    void grow_in_place(std::size_t slots);
    static void write(const std::byte* from, std::size_t there, std::byte* to, std::size_t bytes, int workers) {
        detail::for_shares(bytes / 64, workers, [&](std::size_t first, std::size_t last) {
            const std::size_t end = std::clamp(there, 64 * first, 64 * last);
            if (64 * first < end) std::memcpy(to + 64 * first, from + 64 * first, end - 64 * first);
            std::memset(to + end, 0, 64 * last - end);
        });
    }
    template <class T>
    void move(const Field& field, const aligned_vector<std::uint32_t>& order, std::byte* to, int workers) const {
        const T* const from = reinterpret_cast<const T*>(memory_.data() + field.offset);
        T* const there = reinterpret_cast<T*>(to);
        const std::size_t components = field.components;
        const auto move_one = [&](std::size_t pack, int) {
            move_pack(from, components, order.data() + pack * pack_size, there + pack * (components * pack_size));
        };
        parallel_for(order.size() / pack_size, workers, move_one, packs_at_once);
    }
    template <class T>
    FIRN_INLINE static void move_pack(const T* from, std::size_t components, const std::uint32_t* order, T* to) {
        bool run = true;  // true if the particles of the pack come from consecutive old slots
        for (int l = 1; l < pack_size; ++l) run = run & (order[l] == order[0] + std::uint32_t(l));
        if (run) {
            const int first = int(order[0] % pack_size);
            const T* low = from + place(order[0], components);
            const T* high = from + place(order[pack_size - 1], components) - (pack_size - 1);
            for (std::size_t c = 0; c < components; ++c, low += pack_size, high += pack_size, to += pack_size)
                for (int l = 0; l < pack_size; ++l) to[l] = *((l < pack_size - first ? low : high) + l);
            return;
        }
        const T* of[pack_size];
        for (int l = 0; l < pack_size; ++l) of[l] = from + (order[l] == no_particle ? 0 : place(order[l], components));
        for (std::size_t c = 0; c < components; ++c, to += pack_size)
            for (int l = 0; l < pack_size; ++l) to[l] = of[l][c * pack_size];
    }

    SlotOrder order_ = SlotOrder::sorted;
    std::vector<Field> fields_;
    std::size_t width_ = 0, widest_ = 0;  // bytes per slot: of all fields together, and of the widest field
    std::size_t slots_ = 0;
    bool room_at_end_ = true;
    int workers_ = 1;  // how many sorted the particles, or made room for them
    aligned_vector<std::byte> memory_;
};

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/data/field_memory-inl.hpp>
#endif
