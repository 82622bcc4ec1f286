/// \file The choice of a simulation as JSON text, and from the attributes of a state.
#pragma once

#include <firn/any/choice.hpp>
#include <firn/core/json_value.hpp>
#include <firn/io/state.hpp>
#include <firn/math/rotor.hpp>

#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

template <int D>
inline constexpr std::string_view axis_names = std::string_view("xyz").substr(0, std::size_t(D));

inline Contact read_contact(const JsonValue& json) {
    for (const Contact contact : {Contact::stick, Contact::slip, Contact::separate, Contact::none})
        if (json.text() == name_of(contact)) return contact;
    json.fail(sentence("'", json.text(), "' is no contact; there are: stick, slip, separate, none"));
}
inline std::vector<NamedNumber> read_numbers(const JsonValue& json) {
    std::vector<NamedNumber> numbers;
    for (const JsonValue& one : json.object()) numbers.push_back({one.name(), one.number()});
    return numbers;
}
inline void write_numbers(Json& json, const char* key, const std::vector<NamedNumber>& numbers) {
    if (numbers.empty()) return;
    json.key(key).object([&] {
        for (const NamedNumber& one : numbers) json.field(one.name.c_str(), one.value);
    });
}
template <int D>
void write_vector(Json& json, const char* key, const Vec<double, D>& v) {
    json.key(key).array(v.v, [&](double number) { json.value(number); });
}

template <int D>
Domain<D> read_domain(const JsonValue& json) {
    json.allow({"lower", "upper", "cell_size", "periodic"});
    Domain<D> domain;
    if (const auto* lower = json.find("lower")) domain.lower = lower->vector<D>();
    domain.upper = json.at("upper").vector<D>();
    domain.cell_size = json.at("cell_size").number();
    if (const auto* periodic = json.find("periodic")) {
        if (periodic->array().size() != std::size_t(D)) periodic->fail(sentence("give ", D, " of true and false"));
        std::size_t a = 0;
        for (const JsonValue& one : *periodic) domain.periodic[a++] = one.truth();
    }
    json.checked([&] { check(domain); });
    return domain;
}
template <int D>
void write(Json& json, const Domain<D>& domain) {
    json.object([&] {
        write_vector(json, "lower", domain.lower);
        write_vector(json, "upper", domain.upper);
        json.field("cell_size", domain.cell_size);
        json.key("periodic").array(domain.periodic, [&](bool is) { json.value(is); });
    });
}

template <int D>
Walls<double, D> read_walls(const JsonValue& json, const Domain<D>& domain) {
    json.allow({"shape", "lower", "upper", "contact", "friction", "faces", "nodes_behind"});
    Walls<double, D> walls{domain.lower, domain.upper, {}, {}};
    if (const auto* lower = json.find("lower")) walls.lower = lower->vector<D>();
    if (const auto* upper = json.find("upper")) walls.upper = upper->vector<D>();
    const auto read_face = [](const JsonValue& of, WallOf<double>& wall) {
        if (const auto* contact = of.find("contact")) wall.contact = read_contact(*contact);
        if (const auto* friction = of.find("friction")) wall.friction = friction->number();
    };
    for (std::size_t a = 0; a < std::size_t(D); ++a) {
        read_face(json, walls.at_lower[a]);
        read_face(json, walls.at_upper[a]);
        if (domain.periodic[a]) walls.at_lower[a].contact = walls.at_upper[a].contact = Contact::none;
    }
    if (const auto* faces = json.find("faces"))
        for (const JsonValue& face : faces->object()) {
            const std::string& name = face.name();
            const auto axis = axis_names<D>.find(name.substr(0, 1));
            const bool lower = name.substr(std::min<std::size_t>(1, name.size())) == "_lower";
            if (axis == std::string_view::npos || !(lower || name.substr(1) == "_upper"))
                face.fail(sentence("this is no face; give x_lower, x_upper, y_lower, …, up to the axis ",
                                   axis_names<D>.back()));
            face.allow({"contact", "friction"});
            read_face(face, (lower ? walls.at_lower : walls.at_upper)[axis]);
        }
    if (const auto* nodes = json.find("nodes_behind")) {
        if (nodes->text() != "held" && nodes->text() != "mirrored") nodes->fail("give \"held\" or \"mirrored\"");
        walls.nodes_behind = nodes->text() == "held" ? NodesBehind::held : NodesBehind::mirrored;
    }
    json.checked([&] { walls.check(); });
    return walls;
}
template <int D>
void write(Json& json, const Walls<double, D>& walls) {
    json.field("shape", "walls");
    write_vector(json, "lower", walls.lower);
    write_vector(json, "upper", walls.upper);
    json.field("nodes_behind", walls.nodes_behind == NodesBehind::held ? "held" : "mirrored");
    json.key("faces").object([&] {
        for (std::size_t a = 0; a < std::size_t(D); ++a)
            for (const bool lower : {true, false}) {
                const WallOf<double>& wall = (lower ? walls.at_lower : walls.at_upper)[a];
                json.key(sentence(axis_names<D>[a], lower ? "_lower" : "_upper").c_str()).object([&] {
                    json.field("contact", name_of(wall.contact)).field("friction", wall.friction);
                });
            }
    });
}

/// Calls f(name, value) for each number and each vector of a collider that a text says.
template <class Of, class F>
void for_numbers(Of& collider, const F& f) {
    for_parameters(collider.shape, [&](const std::string& name, const char*, auto& value) { f(name, value); });
    f("friction", collider.friction);
    f("thickness", collider.thickness);
    f("thickness_in_cells", collider.thickness_in_cells);
    f("position", collider.position);
    f("rotation", collider.rotation);
    f("linear_velocity", collider.linear_velocity);
    f("angular_velocity", collider.angular_velocity);
}
/// Reads a rotor: its numbers, or an angle, which is a number of degrees in 2D, an axis and degrees in 3D.
template <class Turn>
Turn read_turn(const JsonValue& json) {
    if (json.is(JsonValue::Kind::array)) return json.vector<int(std::extent_v<decltype(Turn::v)>)>();
    if constexpr (std::same_as<Turn, Rotor<double, 2>>) {
        return rotor(degrees(json.number()));
    } else if constexpr (!std::same_as<Turn, Rotor<double, 3>>) {
        json.fail("give numbers in brackets");
    } else {
        json.allow({"axis", "degrees"});
        return json.checked([&] { return rotor(json.at("axis").vector<3>(), degrees(json.at("degrees").number())); });
    }
}

}  // namespace detail

/// Reads a solid: contact, friction, layer, place and motion, and the numbers that its shape has as parameters.
/// \param others    further members of the object, which the caller reads
/// \param complete  gives the solid that was read the rest of its shape, before it is checked; may be empty
/// \throws io_error  if a member is not known or not valid, or if Collider::check() or complete() throws
///                   parameter_error or mesh_error; the message begins with the line
template <class Shape>
Collider<Shape> read_collider(const JsonValue& json, const std::vector<std::string>& others = {},
                              const std::function<void(Collider<Shape>&)>& complete = {}) {
    Collider<Shape> collider;
    std::vector<std::string> known{"shape", "contact"};
    known.insert(known.end(), others.begin(), others.end());
    detail::for_numbers(collider, [&]<class Value>(const std::string& name, Value& value) {
        known.push_back(name);
        const JsonValue* const one = json.find(name);
        if (!one) return;
        if constexpr (std::is_arithmetic_v<Value>)
            value = one->number();
        else if (name == "rotation")
            value = detail::read_turn<Value>(*one);
        else
            value = one->vector<int(std::extent_v<decltype(value.v)>)>();
    });
    if (const auto* contact = json.find("contact")) collider.contact = detail::read_contact(*contact);
    for (const JsonValue& one : json)
        if (std::find(known.begin(), known.end(), one.name()) == known.end())
            one.fail(
                sentence("a ", json.at("shape").text(), " has no such number; it has: ", detail::listed_names(known)));
    json.checked([&] {
        if (complete) complete(collider);
        collider.check();
    });
    return collider;
}

/// A shape of solids that a program reads by a function of its own, such as a mesh that lies in a file.
template <int D>
struct ShapeReader {
    std::string name;  ///< the shape in the text, "mesh"; none of those that read_choice() knows
    /// Reads a solid from the object that names the shape, and the domain of the choice. It reports mistakes as
    /// JsonValue does, and may call read_collider().
    std::function<BoundaryPart<D>(const JsonValue& json, const Domain<D>& domain)> read;
};

/// Returns readers of the shapes that a program offers, for read_choice(): the members of their solids are the
/// parameters of the shape, and those of all solids.
template <int D, template <class, int> class... Shape>
std::vector<ShapeReader<D>> shape_readers(OfferedShapes<Shape...>) {
    return {ShapeReader<D>{std::string(name_of<Shape<double, D>>()),
                           [](const JsonValue& json, const Domain<D>&) -> BoundaryPart<D> {
                               return detail::named_solid(read_collider<Shape<double, D>>(json));
                           }}...};
}

namespace detail {

inline void write_numbers(Json& json, const NamedNumbers& numbers) {
    json.key(numbers.name.c_str());
    if (numbers.values.size() == 1)
        json.value(numbers.values[0]);
    else
        json.array(numbers.values, [&](double number) { json.value(number); });
}
template <class Shape>
void write(Json& json, const Collider<Shape>& collider) {
    constexpr bool is_named = requires { collider.shape.numbers[0].values; };
    if constexpr (is_named)
        json.field("shape", collider.shape.shape);
    else
        json.field("shape", Shape::name);
    json.field("contact", name_of(collider.contact));
    if constexpr (is_named)
        for (const NamedNumbers& numbers : collider.shape.numbers) write_numbers(json, numbers);
    for_numbers(collider, [&]<class Value>(const std::string& name, const Value& value) {
        if constexpr (std::is_arithmetic_v<Value>)
            json.field(name.c_str(), value);
        else
            write_vector(json, name.c_str(), value);
    });
}

/// \throws parameter_error  if the part is a grid of distances, which is no text
template <int D>
void write(Json& json, const BoundaryPart<D>& part) {
    json.object([&] {
        std::visit(
            [&]<class Part>(const Part& one) {
                if constexpr (std::same_as<Part, Collider<DistanceGrid<double, D>>>)
                    throw parameter_error("A grid of distances is no text; keep the mesh it was made from.");
                else
                    write(json, one);
            },
            part);
    });
}
template <int D>
BoundaryPart<D> read_boundary_part(const JsonValue& json, const Domain<D>& domain,
                                   const std::vector<ShapeReader<D>>& shapes = {}) {
    const JsonValue& shape = json.at("shape");
    if (shape.text() == "walls") return read_walls(json, domain);
    if (shape.text() == "half_space") return read_collider<HalfSpace<double, D>>(json);
    if (shape.text() == "sphere") return read_collider<Sphere<double, D>>(json);
    if (shape.text() == "box") return read_collider<Box<double, D>>(json);
    if (shape.text() == "capsule") return read_collider<Capsule<double, D>>(json);
    std::vector<std::string> names{"walls", "half_space", "sphere", "box", "capsule"};
    for (const ShapeReader<D>& one : shapes) {
        if (one.name == shape.text()) return one.read(json, domain);
        names.push_back(one.name);
    }
    if (D == 2 && shape.text() == "mesh")
        shape.fail(sentence("a mesh is a solid in three dimensions; in two there are: ", listed_names(names)));
    shape.fail(sentence("'", shape.text(), "' is no shape; there are: ", listed_names(names)));
}

}  // namespace detail

/// Reads what a simulation is made of. A member that is not there has its default; one that is not known is a mistake.
///
///     { "domain": {"upper": [1, 1, 1], "cell_size": 0.01}, "transfer": "aflip",
///       "materials": [{"name": "sand", "properties": {"young": 1e6, "friction_angle": 30}}],
///       "boundary": [{"shape": "walls", "contact": "slip", "faces": {"y_lower": {"friction": 0.3}}},
///                    {"shape": "sphere", "radius": 0.1, "position": [0.5, 0.3, 0.5], "friction": 0.5}] }
///
/// A rotation is a rotor, an angle in degrees in 2D, or {"axis": [0, 0, 1], "degrees": 30} in 3D.
/// \param json     the object; further members are left to the caller if it names them in `others`
/// \param others   members that are not of the choice
/// \param shapes   further shapes that solids of the boundary may have
/// \throws io_error  if a member is no valid part of a choice; the message begins with its line
template <int D>
SimulationChoice<D> read_choice(const JsonValue& json, const std::vector<std::string>& others = {},
                                const std::vector<ShapeReader<D>>& shapes = {}) {
    constexpr std::array known{"dimension",
                               "precision",
                               "domain",
                               "transfer",
                               "transfer_parameters",
                               "kernel",
                               "force",
                               "materials",
                               "boundary",
                               "gravity",
                               "threads",
                               "fixed_time_step",
                               "most_steps_between_sorts"};
    for (const JsonValue& one : json.object()) {
        const auto is_it = [&](const std::string& name) { return name == one.name(); };
        if (std::any_of(known.begin(), known.end(), is_it) || std::any_of(others.begin(), others.end(), is_it))
            continue;
        std::vector<std::string> names(known.begin(), known.end());
        names.insert(names.end(), others.begin(), others.end());
        one.fail(sentence("there is no such member; there are: ", detail::listed_names(names)));
    }
    if (const auto* dimension = json.find("dimension"); dimension && dimension->whole() != std::uint64_t(D))
        dimension->fail(sentence("this program simulates in ", D, " dimensions here"));
    SimulationChoice<D> choice;
    choice.domain = detail::read_domain<D>(json.at("domain"));
    const auto read_text = [&](const char* name, std::string& to) {
        if (const auto* one = json.find(name)) to = one->text();
    };
    read_text("precision", choice.precision);
    read_text("transfer", choice.transfer);
    read_text("kernel", choice.kernel);
    read_text("force", choice.force);
    if (choice.precision != "float" && choice.precision != "double")
        json.at("precision").fail("give \"float\" or \"double\"");
    if (const auto* numbers = json.find("transfer_parameters"))
        choice.transfer_parameters = detail::read_numbers(*numbers);
    if (const auto* materials = json.find("materials")) {
        choice.materials.clear();
        for (const JsonValue& one : materials->array()) {
            one.allow({"name", "properties", "parameters"});
            MaterialChoice material{one.at("name").text()};
            if (const auto* numbers = one.find("properties")) material.properties = detail::read_numbers(*numbers);
            if (const auto* numbers = one.find("parameters")) material.parameters = detail::read_numbers(*numbers);
            choice.materials.push_back(std::move(material));
        }
        if (choice.materials.empty()) materials->fail("give at least one material");
    }
    if (const auto* boundary = json.find("boundary")) {
        choice.boundary.emplace();
        for (const JsonValue& one : boundary->array())
            choice.boundary->push_back(detail::read_boundary_part<D>(one, choice.domain, shapes));
    }
    if (const auto* gravity = json.find("gravity")) choice.gravity = gravity->vector<D>();
    if (const auto* dt = json.find("fixed_time_step")) {
        choice.fixed_time_step = dt->number();
        if (choice.fixed_time_step < 0) dt->fail("a time step is not negative; 0 takes the bound");
    }
    if (const auto* most = json.find("most_steps_between_sorts")) choice.most_steps_between_sorts = most->whole();
    if (const auto* threads = json.find("threads")) {
        if (threads->whole() > 65536) threads->fail("give at most 65536 threads");
        choice.threads = int(threads->whole());
    }
    return choice;
}

/// Reads what a simulation is made of from a text. \see read_choice
/// \throws io_error  if the text is no valid JSON, or a member no valid part of a choice
template <int D>
SimulationChoice<D> read_choice(std::string_view text) {
    return read_choice<D>(JsonValue::parse(text));
}

/// Returns the choice as JSON text, from which read_choice() reads the same choice.
/// \throws parameter_error  if a part of the boundary is a grid of distances, which is no text
template <int D>
std::string choice_text(const SimulationChoice<D>& choice) {
    Json json;
    json.object([&] {
        json.field("dimension", D).field("precision", choice.precision);
        json.key("domain");
        detail::write(json, choice.domain);
        json.field("transfer", choice.transfer);
        detail::write_numbers(json, "transfer_parameters", choice.transfer_parameters);
        json.field("kernel", choice.kernel).field("force", choice.force);
        json.key("materials").array(choice.materials, [&](const MaterialChoice& material) {
            json.object([&] {
                json.field("name", material.name);
                detail::write_numbers(json, "properties", material.properties);
                detail::write_numbers(json, "parameters", material.parameters);
            });
        });
        if (choice.boundary)
            json.key("boundary").array(*choice.boundary, [&](const BoundaryPart<D>& part) {
                detail::write(json, part);
            });
        if (choice.gravity) detail::write_vector(json, "gravity", *choice.gravity);
        json.field("fixed_time_step", choice.fixed_time_step)
            .field("most_steps_between_sorts", choice.most_steps_between_sorts)
            .field("threads", choice.threads);
    });
    return json.text();
}

/// Returns the choice with which the run of this state was made, from the state's attributes and parameters: precision,
/// domain, transfer, kernel, force form, gravity and time step, and the one material of the state with its parameters.
/// The boundary is not told by them; it is left as not given.
/// \throws io_error  if the state lacks one of these, so it was not written by state_of()
template <int D, state_scalar S>
SimulationChoice<D> choice_of(const State<S>& state) {
    if (state.dimension != D)
        throw io_error(sentence("The state has ", state.dimension, " dimensions, this choice has ", D, "."));
    const auto attribute = [&](const char* name) {
        for (const StateAttribute& one : state.attributes)
            if (one.name == name) return one.value;
        throw io_error(sentence("The state does not tell its ", name, "; it was not written by state_of()."));
    };
    const auto values = [&](const char* group, const char* name, std::size_t count) {
        for (const StateParameter& one : state.parameters)
            if (one.group == group && one.name == name && one.values.size() == count) return one.values;
        throw io_error(sentence("The state has no parameter ", group, "/", name, " of ", count,
                                " numbers; it was not written by state_of()."));
    };
    const auto vector = [&](const char* group, const char* name) {
        Vec<double, D> v{};
        const std::vector<double> numbers = values(group, name, std::size_t(D));
        for (int a = 0; a < D; ++a) v[a] = numbers[std::size_t(a)];
        return v;
    };
    const auto numbers_of = [&](const char* group) {
        std::vector<NamedNumber> numbers;
        for (const StateParameter& one : state.parameters)
            if (one.group == group && one.values.size() == 1) numbers.push_back({one.name, one.values[0]});
        return numbers;
    };
    SimulationChoice<D> choice;
    choice.domain.lower = vector("grid", "lower");
    choice.domain.upper = vector("grid", "upper");
    choice.domain.cell_size = values("grid", "cell_size", 1)[0];
    const Vec<double, D> periodic = vector("grid", "periodic");
    for (std::size_t a = 0; a < std::size_t(D); ++a) choice.domain.periodic[a] = periodic[int(a)] != 0;
    choice.precision = attribute("precision");
    choice.transfer = attribute("transfer");
    choice.transfer_parameters = numbers_of("transfer");
    choice.kernel = attribute("kernel");
    choice.force = attribute("force");
    choice.materials = {{attribute("material"), {}, numbers_of("material")}};
    choice.gravity = vector("run", "gravity");
    choice.fixed_time_step = values("run", "fixed_time_step", 1)[0];
    choice.most_steps_between_sorts = std::uint64_t(values("run", "most_steps_between_sorts", 1)[0]);
    return choice;
}

}  // namespace firn::inline FIRN_BUILD
