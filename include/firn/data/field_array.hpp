/// \file One field of particles that keep the order of their ids, as an array.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace firn {

/// The values of a field by place. Their memory is the store's, which alone can make it longer.
template <class T>
class FieldArray {
public:
    using value_type = T;

    FieldArray() = default;
    FieldArray(const FieldArray&) = delete;
    FieldArray& operator=(const FieldArray&) = delete;

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    T* data() { return data_; }
    const T* data() const { return data_; }
    T& operator[](std::size_t i) { return data_[i]; }
    const T& operator[](std::size_t i) const { return data_[i]; }
    T* begin() { return data_; }
    T* end() { return data_ + size_; }
    const T* begin() const { return data_; }
    const T* end() const { return data_ + size_; }
    /// The values as they are now.
    std::vector<T> copy() const { return {begin(), end()}; }
    bool operator==(const FieldArray& other) const { return std::equal(begin(), end(), other.begin(), other.end()); }

    /// For the store: where the values lie now.
    void bind(T* data, std::size_t size) { data_ = data, size_ = size; }

private:
    T* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace firn
