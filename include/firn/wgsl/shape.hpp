/// \file Translates values of C++ to WGSL: their types, their components, and expressions that construct them.
#pragma once

#include <firn/core/parameters.hpp>

#include <array>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace firn::wgsl {

/// The translation to WGSL of a type T that is made of recorded numbers. Each specialisation has these functions:
///     type()                  returns the name of the type in WGSL
///     declare(add)            calls add(name, text) for every struct that the type needs, a struct before its users
///     visit(value, text, f)   calls f(component, its text) for every number of a value whose text is `text`
///     build(value, f)         returns the expression that constructs the value from the texts f(component)
template <class T>
struct shape;

/// Calls f(component) for all recorded numbers of a value.
template <class T, class F>
void for_components(T& value, const F& f) {
    shape<T>::visit(value, "", [&](auto& component, const std::string&) { f(component); });
}

namespace detail {

inline std::string joined(const std::vector<std::string>& parts, const char* between) {
    std::string text;
    for (std::size_t i = 0; i < parts.size(); ++i) text += (i ? between : "") + parts[i];
    return text;
}

template <class T>
struct plain_shape {
    template <class Add>
    static void declare(const Add&) {}
};

}  // namespace detail

/// A vector: vecN\<f32>.
template <class S, int N>
struct shape<Vec<S, N>> : detail::plain_shape<S> {
    /// \name Interface of shape
    /// @{

    /// See shape.
    static std::string type() { return "vec" + std::to_string(N) + "<" + shape<S>::type() + ">"; }
    template <class F>
    static void visit(Vec<S, N>& value, const std::string& text, const F& f) {
        for (int i = 0; i < N; ++i) f(value[i], text + "." + "xyzw"[i]);
    }
    template <class F>
    static std::string build(const Vec<S, N>& value, const F& f) {
        std::vector<std::string> parts;
        for (int i = 0; i < N; ++i) parts.push_back(f(value[i]));
        return type() + "(" + detail::joined(parts, ", ") + ")";
    }
    /// @}
};

/// A matrix: matDxD\<f32>, column after column.
template <class S, int D>
struct shape<Mat<S, D>> : detail::plain_shape<S> {
    /// \name Interface of shape
    /// @{

    /// See shape.
    static std::string type() {
        return "mat" + std::to_string(D) + "x" + std::to_string(D) + "<" + shape<S>::type() + ">";
    }
    template <class F>
    static void visit(Mat<S, D>& value, const std::string& text, const F& f) {
        for (int j = 0; j < D; ++j)
            for (int i = 0; i < D; ++i) f(value(i, j), text + "[" + std::to_string(j) + "]." + "xyz"[i]);
    }
    template <class F>
    static std::string build(const Mat<S, D>& value, const F& f) {
        std::vector<std::string> columns;
        for (int j = 0; j < D; ++j) columns.push_back(shape<Vec<S, D>>::build(value.column(j), f));
        return type() + "(" + detail::joined(columns, ", ") + ")";
    }
    /// @}
};

/// An array of one number: the number.
template <class T>
    requires scalar<T>
struct shape<std::array<T, 1>> : detail::plain_shape<T> {
    /// \name Interface of shape
    /// @{

    /// See shape.
    static std::string type() { return shape<T>::type(); }
    template <class F>
    static void visit(std::array<T, 1>& value, const std::string& text, const F& f) {
        f(value[0], text);
    }
    template <class F>
    static std::string build(const std::array<T, 1>& value, const F& f) {
        return f(value[0]);
    }
    /// @}
};

/// An array: a vector if its elements are numbers, an array otherwise.
template <class T, std::size_t N>
struct shape<std::array<T, N>> {
    static constexpr bool numbers = scalar<T>;  ///< whether the elements are numbers

    /// \name Interface of shape
    /// @{

    /// See shape.
    static std::string type() {
        if constexpr (numbers)
            return shape<Vec<T, int(N)>>::type();
        else
            return "array<" + shape<T>::type() + ", " + std::to_string(N) + ">";
    }
    template <class Add>
    static void declare(const Add& add) {
        shape<T>::declare(add);
    }
    template <class F>
    static void visit(std::array<T, N>& value, const std::string& text, const F& f) {
        for (std::size_t i = 0; i < N; ++i)
            if constexpr (numbers)
                f(value[i], text + "." + "xyzw"[i]);
            else
                shape<T>::visit(value[i], text + "[" + std::to_string(i) + "]", f);
    }
    template <class F>
    static std::string build(const std::array<T, N>& value, const F& f) {
        std::vector<std::string> parts;
        for (const T& part : value) parts.push_back(shape<T>::build(part, f));
        return type() + "(" + detail::joined(parts, ", ") + ")";
    }
    /// @}
};

/// A member of a struct: its name in WGSL, and a pointer to it.
template <class Owner, class Member>
struct member {
    const char* name;         ///< in WGSL
    Member Owner::* pointer;  ///< in C++
};
/// Deduces the types from the pointer.
template <class Owner, class Member>
member(const char*, Member Owner::*) -> member<Owner, Member>;

namespace detail {
template <class T>
inline constexpr bool is_empty_array = false;
template <class T>
inline constexpr bool is_empty_array<std::array<T, 0>> = true;
}  // namespace detail

/// The shape of a struct.
/// \tparam Derived  has name(), the name of the struct in WGSL, and members(), a tuple of member{…}. Members that are
///                  empty arrays are left out.
template <class T, class Derived>
struct struct_shape {
    /// Returns the name of the struct in WGSL.
    static std::string type() { return Derived::name(); }
    /// Calls add(name, text) for the structs of the members, then for this one.
    template <class Add>
    static void declare(const Add& add) {
        std::string text = "struct " + type() + " {\n";
        for_members([&](const char* name, auto pointer) {
            using Member = std::remove_cvref_t<decltype(std::declval<T>().*pointer)>;
            shape<Member>::declare(add);
            text += sentence("    ", name, ": ", shape<Member>::type(), ",\n");
        });
        add(type(), text + "}\n");
    }
    /// Calls f(component, its text) for every number of the members.
    template <class F>
    static void visit(T& value, const std::string& text, const F& f) {
        for_members([&](const char* name, auto pointer) {
            auto& part = value.*pointer;
            shape<std::remove_cvref_t<decltype(part)>>::visit(part, text + "." + name, f);
        });
    }
    /// Returns the expression that constructs the struct from the texts f(component).
    template <class F>
    static std::string build(const T& value, const F& f) {
        std::vector<std::string> parts;
        for_members([&](const char*, auto pointer) {
            const auto& part = value.*pointer;
            parts.push_back(shape<std::remove_cvref_t<decltype(part)>>::build(part, f));
        });
        return type() + "(" + detail::joined(parts, ", ") + ")";
    }

private:
    template <class F>
    static void for_members(const F& f) {
        std::apply(
            [&](const auto&... each) {
                const auto call = [&](const auto& m) {
                    if constexpr (!detail::is_empty_array<std::remove_cvref_t<decltype(std::declval<T>().*m.pointer)>>)
                        f(m.name, m.pointer);
                };
                (call(each), ...);
            },
            Derived::members());
    }
};

}  // namespace firn::wgsl
