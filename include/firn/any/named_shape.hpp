/// \file Shapes of a program's own that are chosen at run time, by their name and by the names of their numbers.
#pragma once

#include <firn/any/properties.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/core/parameters.hpp>

#include <string>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Shapes of a program's own to choose from: templates of a scalar type and the dimension, as boundary/shape.hpp
/// describes them. For a wrapper, give an alias template:
/// `template <class S, int D> using Tank = Complement<Box<S, D>>;`.
///
/// States name the boundary with all of its kinds of solids. So a state from a program that offers other shapes is
/// restored by Restart::converted.
template <template <class, int> class... Shape>
struct OfferedShapes {};

/// Numbers and their name: one number, or those of a vector.
struct NamedNumbers {
    std::string name;            ///< such as "half_extents"
    std::vector<double> values;  ///< in the unit of what has this name

    bool operator==(const NamedNumbers&) const = default;
};

/// A shape that a program offers, by its name. In a choice, `Collider<NamedShape<D>>` is a solid of this shape; the
/// simulation has a collider of the shape itself.
template <int D>
struct NamedShape {
    std::string shape;                    ///< the name of the shape, as it declares it: "torus"
    std::vector<NamedNumbers> numbers{};  ///< its parameters; those that are not given have their defaults

    using scalar_type = double;
    static constexpr int dimension = D;
    static constexpr const char* name = "named_shape";
};

namespace detail {

/// Copies all of a solid but its shape.
template <class From, class To>
void copy_collider(const Collider<From>& from, Collider<To>& to) {
    to.contact = from.contact;
    to.friction = from.friction;
    to.thickness = from.thickness;
    to.thickness_in_cells = from.thickness_in_cells;
    to.position = from.position;
    to.rotation = from.rotation;
    to.linear_velocity = from.linear_velocity;
    to.angular_velocity = from.angular_velocity;
}

/// Returns a solid with its shape told by names.
template <class Shape, int D = shape_facts<Shape>::dimension>
Collider<NamedShape<D>> named_solid(const Collider<Shape>& solid) {
    Collider<NamedShape<D>> named{.shape = {std::string(name_of<Shape>())}};
    for_parameters(solid.shape, [&](const std::string& name, const char*, const auto& value) {
        named.shape.numbers.push_back({name, as_doubles(value)});
    });
    copy_collider(solid, named);
    return named;
}
/// Returns the solid that names tell.
/// \throws parameter_error  if the shape has no parameter of a name, or another count of numbers in it
template <class Shape, int D>
Collider<Shape> typed_solid(const Collider<NamedShape<D>>& named) {
    Collider<Shape> solid;
    copy_collider(named, solid);
    for (const NamedNumbers& numbers : named.shape.numbers) {
        bool found = false;
        std::vector<std::string> names;
        for_parameters(solid.shape, [&](const std::string& name, const char*, auto& value) {
            names.push_back(name);
            if (name != numbers.name) return;
            found = true;
            const std::size_t count = as_doubles(value).size();
            if (numbers.values.size() != count)
                throw parameter_error(sentence("The parameter ", name, " of ", name_of<Shape>(), " has ", count,
                                               count == 1 ? " number; " : " numbers; ", numbers.values.size(),
                                               " are given."));
            using Value = std::remove_cvref_t<decltype(value)>;
            if constexpr (std::is_arithmetic_v<Value>)
                value = Value(numbers.values[0]);
            else
                for (int i = 0; i < int(count); ++i) value[i] = numbers.values[std::size_t(i)];
        });
        if (!found) throw_unnamed("parameter", name_of<Shape>(), numbers.name, names);
    }
    return solid;
}

/// Returns the names of shapes of a program's own.
template <int D, template <class, int> class... Shape>
std::vector<std::string> names_of(OfferedShapes<Shape...>) {
    return {std::string(name_of<Shape<double, D>>())...};
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
