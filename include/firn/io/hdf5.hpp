/// \file Helpers for HDF5's C interface: handles that close HDF5 objects in their destructors, and checks of the
/// results of HDF5 functions.
///
/// If an HDF5 function fails, the helpers throw an io_error. The message of the error says what was tried, and includes
/// the reason that HDF5 reports. naming_file() adds the name of the file to the message.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>
#include <firn/io/needs_hdf5.hpp>

#include <hdf5.h>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::hdf5 {

/// A guard: while an object of this class exists, HDF5 prints no error messages, because firn throws the errors as
/// exceptions. The destructor restores HDF5's former setting.
class Quiet {
public:
    /// Switches off HDF5's printing of errors.
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

/// Returns HDF5's description of the last error. HDF5 reports a list of causes for an error. The result is the text of
/// the innermost cause, which includes errno and its description if a system call failed.
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

/// Returns `result`, the result of an HDF5 function, if it is not negative.
/// \param result  the result; a negative number means that the HDF5 function failed
/// \param tried   what was tried, for example "read the attribute unit"; the error's message is "could not TRIED
///                (HDF5's reason)"
/// \throws io_error  if `result` is negative
template <std::signed_integral Result>
Result check(Result result, std::string_view tried) {
    if (result < 0) throw io_error(sentence("could not ", tried, " (", last_error(), ")"));
    return result;
}

/// Owner of an HDF5 object's identifier (hid_t). The destructor closes the identifier.
/// \tparam Close  the HDF5 function that closes identifiers of this kind, for example H5Fclose for files
template <herr_t (*Close)(hid_t)>
class Handle {
public:
    /// Makes a handle that owns no identifier.
    Handle() = default;
    /// Makes a handle that owns the identifier `id`.
    /// \param id     the result of an HDF5 function
    /// \param tried  what was tried, for the error's message; see check()
    /// \throws io_error  if `id` is negative
    Handle(hid_t id, std::string_view tried) : id_(check(id, tried)) {}
    /// Takes over the identifier of `other`. Afterwards, `other` owns no identifier.
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
    /// Exchanges the identifiers of the two handles.
    Handle& operator=(Handle&& other) noexcept {
        std::swap(id_, other.id_);
        return *this;
    }
    ~Handle() {
        if (id_ >= 0) Close(id_);
    }

    hid_t id() const { return id_; }  ///< The identifier; −1 if the handle owns no identifier.
    /// Closes the identifier. This can fail, because HDF5 may write buffered data when it closes an object.
    /// \param tried  what was tried, for the error's message; see check()
    /// \throws io_error  if closing fails
    void close(std::string_view tried) { check(Close(std::exchange(id_, -1)), tried); }

private:
    hid_t id_ = -1;
};

/// \name Handles of HDF5's objects
/// @{

/// Owner of the identifier of one kind of HDF5 object. The destructor closes the identifier.
using File = Handle<H5Fclose>;
using Group = Handle<H5Gclose>;
using Dataset = Handle<H5Dclose>;
using Dataspace = Handle<H5Sclose>;
using Datatype = Handle<H5Tclose>;
using Attribute = Handle<H5Aclose>;
using Properties = Handle<H5Pclose>;
/// @}

/// The HDF5 types for the C++ number type T. memory() is the type of a T in memory; file() is the type that firn writes
/// to files (little endian; IEEE 754 for floats); big_endian() is like file(), but big endian. `name` is the name of
/// the type in messages, such as "64-bit float".
/// \tparam T  float, double, std::uint8_t, std::int32_t, std::int64_t or std::uint64_t
template <class T>
struct Number;
/// \cond
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
/// \endcond

/// What Number says of one type, as values, so that a function which uses it is compiled once.
struct NumberType {
    hid_t memory;           ///< Type of a number in memory.
    hid_t file;             ///< Type that firn writes to files, little endian.
    hid_t big_endian;       ///< The same, but big endian.
    std::size_t bytes;      ///< Size of one number [bytes].
    std::string_view name;  ///< Name for messages, such as "64-bit float".
};
/// Returns the NumberType of the C++ number type T, one of those that Number has.
template <class T>
NumberType number_type() {
    return {Number<T>::memory(), Number<T>::file(), Number<T>::big_endian(), sizeof(T), Number<T>::name};
}

/// Returns whether `type`, the type of the values in a file, is this number type, in little-endian or big-endian byte
/// order.
inline bool is_number(const Datatype& type, const NumberType& number) {
    return check(H5Tequal(type.id(), number.file), "compare types") > 0 ||
           check(H5Tequal(type.id(), number.big_endian), "compare types") > 0;
}
/// Returns whether `type` is the number type T.
template <class T>
bool is_number(const Datatype& type) {
    return is_number(type, number_type<T>());
}

/// Returns the name of the type `type` for messages, such as "64-bit float" or "string".
inline std::string_view type_name(const Datatype& type) {
    for (const NumberType& number :
         {number_type<float>(), number_type<double>(), number_type<std::uint8_t>(), number_type<std::int32_t>(),
          number_type<std::int64_t>(), number_type<std::uint64_t>()})
        if (is_number(type, number)) return number.name;
    return H5Tget_class(type.id()) == H5T_STRING ? "string" : "type that firn does not know";
}

/// Returns the mutex that firn locks while it calls HDF5. Only one thread at a time may call HDF5. So if your program
/// calls HDF5 itself while a BackgroundSeries exists, your program must lock this mutex during each call.
inline std::mutex& library() {
    static std::mutex one;
    return one;
}

/// Calls `f()` and returns the result of the call. During the call, the mutex library() is locked, and HDF5 prints no
/// errors.
/// \param path  the name of the file that `f` uses, for messages
/// \throws io_error  if `f` throws an io_error; the message is that of the error from `f`, with the name of the file in
///                   front
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

}  // namespace firn::inline FIRN_BUILD::hdf5
