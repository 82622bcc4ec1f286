/// \file NumPy arrays from memory of the module, and values of firn from arguments.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace python {

namespace nb = nanobind;

/// An array of a Python program, in the order of C.
template <class T>
using Array = nb::ndarray<T, nb::c_contig, nb::device::cpu>;
using Numbers = std::vector<double>;  ///< of a list, a tuple or an array

/// Returns the shape of an array of `count` rows: a matrix of 2 × 2 or 3 × 3 is an array of two axes, a scalar none.
inline std::vector<std::size_t> shape_of(std::size_t count, int components) {
    switch (components) {
        case 1:
            return {count};
        case 4:
            return {count, 2, 2};
        case 9:
            return {count, 3, 3};
        default:
            return {count, std::size_t(components)};
    }
}

/// Returns an array that shows memory of the object `owner`, which then lives as long as the array.
template <class T>
nb::object view_of(T* data, const std::vector<std::size_t>& shape, nb::handle owner) {
    return nb::cast(nb::ndarray<nb::numpy, T>(data, shape.size(), shape.data(), owner), nb::rv_policy::reference);
}

/// Returns an array that takes memory over.
template <class T>
nb::object array_of(std::unique_ptr<T[]> data, const std::vector<std::size_t>& shape) {
    nb::capsule owner(data.get(), [](void* memory) noexcept { delete[] static_cast<T*>(memory); });
    return view_of(data.release(), shape, owner);
}

/// Returns an array of the numbers of a vector.
/// @{
template <class T>
nb::object array_of(const std::vector<T>& numbers, const std::vector<std::size_t>& shape) {
    std::unique_ptr<T[]> data(new T[numbers.size()]);
    std::copy(numbers.begin(), numbers.end(), data.get());
    return array_of(std::move(data), shape);
}
template <class T>
nb::object array_of(const std::vector<T>& numbers) {
    return array_of(numbers, {numbers.size()});
}
/// @}

/// Returns D numbers as a vector. \throws firn::parameter_error  if there are not D
template <int D>
firn::Vec<double, D> vector_of(const Numbers& numbers, const char* what) {
    if (numbers.size() != std::size_t(D))
        throw firn::parameter_error(
            firn::sentence(what, " has ", numbers.size(), " numbers; give ", D, ", one for each dimension."));
    firn::Vec<double, D> vector{};
    for (int a = 0; a < D; ++a) vector[a] = numbers[std::size_t(a)];
    return vector;
}
template <int D>
Numbers numbers_of(const firn::Vec<double, D>& vector) {
    return {vector.v, vector.v + D};
}
inline Numbers numbers_of(double number) { return {number}; }

}  // namespace python
