/// \file Translates C++ values to WGSL: types, components of values, and expressions that construct values.
#pragma once

#include <firn/core/parameters.hpp>

#include <array>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::wgsl {

/// Translates a type T to WGSL. The values of T consist of scalars of type `recorded`, the components. Each
/// specialisation has these functions:
///     type()                  returns the name of the type in WGSL
///     declare(add)            calls add(name, text) for every WGSL struct that values of type T need. `text` is the
///                             declaration of the struct. A struct comes before the structs that contain it.
///     visit(value, text, f)   calls f(component, expression) for every component of the value. `text` is the WGSL
///                             expression of the whole value, `expression` that of the component. If `text` is "v", the
///                             first component of a vector has the expression "v.x".
///     build(value, f)         returns the WGSL expression that constructs the value from its components; f(component)
///                             returns the expression of a component
template <class T>
struct shape;

/// Whether there is a translation of T to WGSL.
template <class T>
concept has_shape = requires { sizeof(shape<T>); };

/// Calls f(component) for every component (scalar of type `recorded`) of a value, in the order in which the function
/// `visit` of shape\<T> visits them.
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

/// Translates a vector of N components to the WGSL type vecN\<f32>.
template <class S, int N>
    requires has_shape<S>
struct shape<Vec<S, N>> : detail::plain_shape<S> {
    /// \name Interface of shape
    /// @{

    /// type(), visit() and build() are described at the template shape.
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

/// Translates a D × D matrix to the WGSL type matDxD\<f32>. visit() visits the components column by column.
template <class S, int D>
struct shape<Mat<S, D>> : detail::plain_shape<S> {
    /// \name Interface of shape
    /// @{

    /// type(), visit() and build() are described at the template shape.
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

/// Translates an array of one scalar to the WGSL type f32.
template <class T>
    requires scalar<T>
struct shape<std::array<T, 1>> : detail::plain_shape<T> {
    /// \name Interface of shape
    /// @{

    /// type(), visit() and build() are described at the template shape.
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

/// Translates an array of N elements to WGSL: to the type vecN\<f32> if the elements are scalars, otherwise to an
/// array.
template <class T, std::size_t N>
struct shape<std::array<T, N>> {
    static constexpr bool numbers = scalar<T>;  ///< whether the elements are scalars (not structs or vectors)

    /// \name Interface of shape
    /// @{

    /// type(), declare(), visit() and build() are described at the template shape.
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

/// Describes a member of a struct by its name in WGSL and by a pointer to the member of the C++ struct.
template <class Owner, class Member>
struct member {
    const char* name;         ///< name of the member in WGSL
    Member Owner::* pointer;  ///< pointer to the member of the C++ struct
};
/// Deduces Owner (the struct) and Member (the type of the member) from the pointer.
template <class Owner, class Member>
member(const char*, Member Owner::*) -> member<Owner, Member>;

namespace detail {
template <class T>
inline constexpr bool is_empty_array = false;
template <class T>
inline constexpr bool is_empty_array<std::array<T, 0>> = true;
}  // namespace detail

/// Translates a C++ struct T to a WGSL struct. It is a base class for specialisations of wgsl::shape.
/// \tparam Derived  the class that derives from struct_shape. Derived::name() returns the name of the struct in WGSL.
///                  Derived::members() returns a tuple with a member{…} for each member of the struct; members that are
///                  empty arrays are left out of the WGSL struct.
template <class T, class Derived>
struct struct_shape {
    /// Returns the name of the struct in WGSL.
    static std::string type() { return Derived::name(); }
    /// Calls add(name, text) for every WGSL struct that the members of T need, then for the WGSL struct of T. `name` is
    /// the name of the struct, `text` its declaration.
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
    /// Calls f(component, expression) for every component (scalar of type `recorded`) in the members of `value`. `text`
    /// is the WGSL expression of `value`, `expression` that of the component.
    template <class F>
    static void visit(T& value, const std::string& text, const F& f) {
        for_members([&](const char* name, auto pointer) {
            auto& part = value.*pointer;
            shape<std::remove_cvref_t<decltype(part)>>::visit(part, text + "." + name, f);
        });
    }
    /// Returns the WGSL expression that constructs `value`. f(component) must return the expression of a component.
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

}  // namespace firn::inline FIRN_BUILD::wgsl
