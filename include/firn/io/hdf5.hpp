/// \file HDF5's C interface with owners that close, results that are checked and errors that speak.
///
/// Functions here throw io_error with what was tried and HDF5's own words; whoever knows the file adds its name
/// (`naming_file`).
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>

#if !__has_include(<hdf5.h>)
#error "firn's states need HDF5: in CMake link firn::hdf5, not firn::firn; without, $(pkg-config --cflags --libs hdf5)."
#include <firn::hdf5 is not linked>
#endif
#include <hdf5.h>

#include <concepts>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::hdf5 {

/// While it lives HDF5 does not print its errors: they come as exceptions. Puts back what was set before.
class Quiet {
public:
    Quiet() {
        H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
        H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    }
    Quiet(const Quiet&) = delete;
    Quiet& operator=(const Quiet&) = delete;
    ~Quiet() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

private:
    H5E_auto2_t function_ = nullptr;
    void* data_ = nullptr;
};

/// HDF5's description of the last failure, the innermost cause (which holds errno and its text).
inline std::string last_error() {
    std::string text;
    const auto keep_first = [](unsigned, const H5E_error2_t* entry, void* out) -> herr_t {
        try {
            auto& kept = *static_cast<std::string*>(out);
            if (kept.empty() && entry->desc) kept = entry->desc;
        } catch (...) {
            return -1;
        }
        return 0;
    };
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first, &text);
    return text.empty() ? "HDF5 gives no reason" : text;
}

/// Returns what an HDF5 function returned; throws io_error where that says it failed (all its functions: negative).
template <std::signed_integral Result>
Result check(Result result, std::string_view tried) {
    if (result < 0) throw io_error(sentence("could not ", tried, " (", last_error(), ")"));
    return result;
}

/// Owner of an HDF5 identifier.
template <herr_t (*Close)(hid_t)>
class Handle {
public:
    Handle() = default;
    Handle(hid_t id, std::string_view tried) : id_(check(id, tried)) {}
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(id_, other.id_);
        return *this;
    }
    ~Handle() {
        if (id_ >= 0) Close(id_);
    }

    hid_t id() const { return id_; }
    /// Closing can write what was held back, and so can fail.
    void close(std::string_view tried) { check(Close(std::exchange(id_, -1)), tried); }

private:
    hid_t id_ = -1;
};

using File = Handle<H5Fclose>;
using Group = Handle<H5Gclose>;
using Dataset = Handle<H5Dclose>;
using Dataspace = Handle<H5Sclose>;
using Datatype = Handle<H5Tclose>;
using Attribute = Handle<H5Aclose>;
using Properties = Handle<H5Pclose>;

/// A C++ number's type in memory and in the file (little endian, IEEE).
template <class T>
struct Number;
#define FIRN_HDF5_NUMBER(type, in_memory, in_file, other_order, words) \
    template <>                                                        \
    struct Number<type> {                                              \
        static hid_t memory() { return in_memory; }                    \
        static hid_t file() { return in_file; }                        \
        static hid_t big_endian() { return other_order; }              \
        static constexpr std::string_view name = words;                \
    }
FIRN_HDF5_NUMBER(float, H5T_NATIVE_FLOAT, H5T_IEEE_F32LE, H5T_IEEE_F32BE, "32-bit float");
FIRN_HDF5_NUMBER(double, H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE, H5T_IEEE_F64BE, "64-bit float");
FIRN_HDF5_NUMBER(std::uint8_t, H5T_NATIVE_UINT8, H5T_STD_U8LE, H5T_STD_U8BE, "8-bit unsigned integer");
FIRN_HDF5_NUMBER(std::int32_t, H5T_NATIVE_INT32, H5T_STD_I32LE, H5T_STD_I32BE, "32-bit integer");
FIRN_HDF5_NUMBER(std::int64_t, H5T_NATIVE_INT64, H5T_STD_I64LE, H5T_STD_I64BE, "64-bit integer");
FIRN_HDF5_NUMBER(std::uint64_t, H5T_NATIVE_UINT64, H5T_STD_U64LE, H5T_STD_U64BE, "64-bit unsigned integer");
#undef FIRN_HDF5_NUMBER

/// Whether a type in a file is the number T, in either byte order.
template <class T>
bool is_number(const Datatype& type) {
    return check(H5Tequal(type.id(), Number<T>::file()), "compare types") > 0 ||
           check(H5Tequal(type.id(), Number<T>::big_endian()), "compare types") > 0;
}

/// The number a type in a file is, in words.
inline std::string_view type_name(const Datatype& type) {
    if (is_number<float>(type)) return Number<float>::name;
    if (is_number<double>(type)) return Number<double>::name;
    if (is_number<std::uint8_t>(type)) return Number<std::uint8_t>::name;
    if (is_number<std::int32_t>(type)) return Number<std::int32_t>::name;
    if (is_number<std::int64_t>(type)) return Number<std::int64_t>::name;
    if (is_number<std::uint64_t>(type)) return Number<std::uint64_t>::name;
    return H5Tget_class(type.id()) == H5T_STRING ? "string" : "type that firn does not know";
}

/// HDF5's library serves one thread at a time. firn holds this while it is in it; a program that calls HDF5 itself
/// while a BackgroundSeries writes holds it, too.
inline std::mutex& library() {
    static std::mutex one;
    return one;
}

/// Runs f alone in HDF5, with HDF5 quiet, and puts the file's name before what it throws as io_error.
template <class F>
auto naming_file(const std::filesystem::path& path, F&& f) {
    const std::lock_guard alone(library());
    const Quiet quiet;
    try {
        return f();
    } catch (const io_error& failure) {
        const std::string_view what = failure.what();
        throw io_error(sentence("The state ", path, ": ", what, what.ends_with('.') ? "" : "."));
    }
}

}  // namespace firn::hdf5
