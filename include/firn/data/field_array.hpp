/// \file An array of the values of one field, in the order in which particles were added.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// The values of one field, one value per particle. The particle store owns the memory of the values, and only the
/// store can change how many there are.
template <class T>
class FieldArray {
public:
    using value_type = T;  ///< type of a value

    FieldArray() = default;
    FieldArray(const FieldArray&) = delete;
    FieldArray& operator=(const FieldArray&) = delete;

    /// Number of values: one for each particle.
    std::size_t size() const { return size_; }
    /// True if there are no values.
    bool empty() const { return size_ == 0; }
    /// \name Access
    /// @{

    /// Give access to the values by pointer, index or iterator.
    T* data() { return data_; }
    const T* data() const { return data_; }
    T& operator[](std::size_t i) { return data_[i]; }
    const T& operator[](std::size_t i) const { return data_[i]; }
    T* begin() { return data_; }
    T* end() { return data_ + size_; }
    const T* begin() const { return data_; }
    const T* end() const { return data_ + size_; }
    /// @}

    /// Returns a copy of all values.
    std::vector<T> copy() const { return {begin(), end()}; }
    /// True if both arrays have the same size and the same values.
    bool operator==(const FieldArray& other) const { return std::equal(begin(), end(), other.begin(), other.end()); }

    /// Sets the address of the first value, and how many values there are. Only the particle store may call bind().
    void bind(T* data, std::size_t size) { data_ = data, size_ = size; }

private:
    T* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
