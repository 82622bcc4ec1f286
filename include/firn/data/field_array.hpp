/// \file One field of particles in the order in which they were added, as an array.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace firn {

/// The values of a field, one per particle. The memory belongs to the particles' store; only the store can change the
/// number of values.
template <class T>
class FieldArray {
public:
    using value_type = T;  ///< type of a value

    FieldArray() = default;
    FieldArray(const FieldArray&) = delete;
    FieldArray& operator=(const FieldArray&) = delete;

    /// Number of values.
    std::size_t size() const { return size_; }
    /// True if there are no values.
    bool empty() const { return size_ == 0; }
    /// \name Access
    /// @{

    /// The values by pointer, index and iterator.
    T* data() { return data_; }
    const T* data() const { return data_; }
    T& operator[](std::size_t i) { return data_[i]; }
    const T& operator[](std::size_t i) const { return data_[i]; }
    T* begin() { return data_; }
    T* end() { return data_ + size_; }
    const T* begin() const { return data_; }
    const T* end() const { return data_ + size_; }
    /// @}

    /// A copy of all values.
    std::vector<T> copy() const { return {begin(), end()}; }
    /// Equal in size and in all values.
    bool operator==(const FieldArray& other) const { return std::equal(begin(), end(), other.begin(), other.end()); }

    /// Sets where the values lie and their number. For the store only.
    void bind(T* data, std::size_t size) { data_ = data, size_ = size; }

private:
    T* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace firn
