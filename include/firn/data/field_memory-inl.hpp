/// \file Bodies of field_memory.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/data/field_memory.hpp>

namespace firn::inline FIRN_BUILD {

FIRN_BODY void FieldMemory::make_like(const FieldMemory& other) {
    order_ = other.order_, fields_ = other.fields_, width_ = other.width_, widest_ = other.widest_;
    slots_ = other.slots_, room_at_end_ = other.room_at_end_, workers_ = other.workers_;
    if (memory_.size() != other.memory_.size()) {
        memory_.clear();
        memory_.resize(other.memory_.size());
    }
}

FIRN_BODY FieldMemory& FieldMemory::operator=(const FieldMemory& other) {
    if (this == &other) return *this;
    make_like(other);
    const std::size_t begin = fields_.empty() ? 0 : fields_.front().offset, bytes = end_of_fields() - begin;
    detail::copy_and_fill(other.memory_.data() + begin, bytes, memory_.data() + begin, bytes, std::byte{}, workers_);
    return *this;
}

FIRN_BODY void FieldMemory::grow(std::size_t slots, int workers) {
    if (memory_.size() >= bytes_for(slots)) return grow_in_place(slots);
    FieldMemory larger(order_, fields_, width_, widest_);
    larger.slots_ = slots;
    larger.workers_ = workers;
    larger.memory_.resize(bytes_for(slots));
    if (bytes_for(slots) < detail::least_shared_bytes) workers = 1;
    std::size_t offset = 0;
    for (std::size_t f = 0; f < fields_.size(); ++f) {
        const std::size_t bytes = slots * fields_[f].bytes_of_slot();
        larger.fields_[f].offset = offset;
        write(numbers<std::byte>(f), slots_ * fields_[f].bytes_of_slot(), larger.numbers<std::byte>(f), bytes, workers);
        offset += bytes;
    }
    write(nullptr, 0, larger.memory_.data() + offset, slots * widest_, workers);
    *this = std::move(larger);
}

FIRN_BODY void FieldMemory::grow_in_place(std::size_t slots) {
    const std::size_t count = fields_.size();
    std::size_t end = room_at_end_ ? bytes_for(slots) - slots * widest_ : memory_.size() - slots * width_;
    for (std::size_t i = 0; i < count; ++i) {  // a field is moved before another field takes its place
        Field& field = fields_[room_at_end_ ? count - 1 - i : i];
        const std::size_t there = slots_ * field.bytes_of_slot(), bytes = slots * field.bytes_of_slot();
        const std::size_t to = room_at_end_ ? end - bytes : end;
        std::memmove(memory_.data() + to, memory_.data() + field.offset, there);
        std::memset(memory_.data() + to + there, 0, bytes - there);
        field.offset = to;
        end = room_at_end_ ? to : to + bytes;
    }
    slots_ = slots;
}

}  // namespace firn::inline FIRN_BUILD
