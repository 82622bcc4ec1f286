// quick: no
/// \file Solids of a program's own shapes, chosen at run time: bit for bit those that are chosen at compile time, as
/// text, and what is refused.
#include "../../../examples/own_shape.hpp"

#include "support/message.hpp"
#include <firn/any/json.hpp>
#include <firn/any/run_of.hpp>
#include <firn/any_simulation.hpp>
#include <firn/simulation.hpp>

#include <string>
#include <vector>

namespace own_shape_tests {
namespace {

using namespace firn;
using test_support::check_refused;

template <class S, int D>
using Tank = Complement<Box<S, D>>;
using Own = OfferedShapes<Tank, RoundedBox>;
using Few = Offer<OfferedMaterials<FixedCorotated>, OfferedTransfers<Apic>, OfferedPrecisions<float>,
                  OfferedKernels<QuadraticBSpline>, OfferedForces<MlsForce>, Own>;

const std::string text = R"({
  "domain": {"upper": [1, 1], "cell_size": 0.0625},
  "materials": [{"name": "fixed_corotated", "properties": {"young": 1e4, "poisson": 0.25}}],
  "boundary": [
    {"shape": "rounded_box", "half_extents": [0.2, 0.125], "rounding": 0.0625, "position": [0.5, 0.25],
     "rotation": 20, "friction": 0.5, "linear_velocity": [0.25, 0.5], "angular_velocity": 2},
    {"shape": "sphere", "radius": 0.125, "position": [0.125, 0.125]},
    {"shape": "outside_box", "hollow_half_extents": [0.4375, 0.4375], "position": [0.5, 0.5], "contact": "slip"},
    {"shape": "rounded_box", "position": [0.85, 0.15]}
  ]
})";

SimulationChoice<2> read(const std::string& from) {
    return read_choice<2>(JsonValue::parse(from), {}, shape_readers<2>(Own{}));
}
using Named = Collider<NamedShape<2>>;
Named named(const SimulationChoice<2>& choice, std::size_t part) { return std::get<Named>((*choice.boundary)[part]); }

Samples<2> cube() { return sample_box<2>({0.35, 0.5}, {0.7, 0.75}, {.spacing = 1. / 32}); }

}  // namespace

TEST_CASE("a program's own solid has the bits of the one chosen at compile time", "[any]") {
    AnySimulation<2> any(read(text), Few{});
    any.add(0, cube(), 1000, {0, -1});

    Collider<RoundedBox<float, 2>> box{.friction = 0.5,
                                       .position = {0.5, 0.25},
                                       .rotation = rotor(degrees(20)),
                                       .linear_velocity = {0.25, 0.5},
                                       .angular_velocity = 2};
    box.shape.half_extents = {0.2F, 0.125F};
    box.shape.rounding = 0.0625F;
    const Collider<Sphere<float, 2>> ball{.shape = {0.125F}, .position = {0.125, 0.125}};
    const Collider<Tank<float, 2>> tank{
        .shape = {{{0.4375F, 0.4375F}}}, .contact = Contact::slip, .position = {0.5, 0.5}};
    const Collider<RoundedBox<float, 2>> corner{.position = {0.85, 0.15}};
    Simulation typed(Domain<2>{{0, 0}, {1, 1}, 0.0625}, FixedCorotated<float>::from_young_poisson(1e4, 0.25),
                     Together(ball, tank, box, corner));
    typed.add(cube(), 1000, {0, -1});

    any.measure_reactions();
    typed.reactions.emplace();
    any.advance(0.2);
    typed.advance(0.2);
    CHECK(any.steps() > 10);
    const auto mine = std::get<State<float>>(any.state(0)), theirs = state_of(typed);
    CHECK(mine.fields == theirs.fields);
    const auto now = std::get<Named>(any.boundary_part(0));
    CHECK(now.position[1] == std::get<2>(typed.boundary.parts).position[1]);
    CHECK(now.position[1] == Approx(0.35));
    CHECK(now.rotation[1] == std::get<2>(typed.boundary.parts).rotation[1]);
    CHECK(now.rotation[1] == Approx(std::sin(0.5 * (degrees(20).in_radians() + 2 * 0.2))));
    CHECK(now.shape.shape == "rounded_box");
    CHECK(now.shape.numbers == named(any.choice(), 0).shape.numbers);
    for (const auto& [part, place] : {std::pair{0u, 2u}, {1u, 0u}, {2u, 1u}, {3u, 3u}})
        CHECK(any.reaction(part).impulse[1] == typed.reactions->parts[place].impulse[1]);
    CHECK(any.reaction(0).impulse[1] > 0);  // the box bears the body

    auto other = now;
    other.shape.numbers = {{"half_extents", {0.25, 0.125}}, {"rounding", {0.03125}}};
    other.linear_velocity = {};
    any.set_boundary_part(0, other);
    auto& changed = std::get<2>(typed.boundary.parts);
    changed.shape = {{0.25F, 0.125F}, 0.03125F};
    changed.linear_velocity = {};
    any.advance(0.02);
    typed.advance(0.02);
    CHECK(std::get<State<float>>(any.state(0)).fields == state_of(typed).fields);
    CHECK(named(any.choice(), 0).shape.numbers == other.shape.numbers);

    auto tank_again = std::get<Named>(any.boundary_part(2));
    check_refused<parameter_error>([&] { any.set_boundary_part(0, tank_again); }, "keeps its shape");
    check_refused<parameter_error>([&] { any.set_boundary_part(1, other); }, "keeps its shape");
    other.shape.numbers[1].values[0] = 0.5;
    check_refused<parameter_error>([&] { any.set_boundary_part(0, other); }, "The rounding of a rounded box is 0.5 m");
    CHECK(named(any.choice(), 0).shape.numbers[1].values[0] == 0.03125);
}

TEST_CASE("a text says solids of a program's own", "[any]") {
    const auto choice = read(text);
    const Named box = named(choice, 0);
    CHECK(box.shape.shape == "rounded_box");
    CHECK(box.shape.numbers == std::vector<NamedNumbers>{{"half_extents", {0.2, 0.125}}, {"rounding", {0.0625}}});
    CHECK(box.friction == 0.5);
    CHECK(box.rotation[1] == Approx(std::sin(0.5 * degrees(20).in_radians())));
    CHECK(named(choice, 2).contact == Contact::slip);
    CHECK(named(choice, 3).shape.numbers ==
          std::vector<NamedNumbers>{{"half_extents", {0.1, 0.1}}, {"rounding", {0.02}}});
    CHECK(choice_text(read(choice_text(choice))) == choice_text(choice));

    const auto check_mistake = [](const std::string& part, const std::string& by, int line, const std::string& says) {
        test_support::check_mistake<io_error>(read, text, part, by, line, says);
    };
    check_mistake("\"rounding\": 0.0625", "\"rounding\": 0.5", 5, "rounding: The rounding of a rounded box is 0.5 m");
    check_mistake("\"rounding\": 0.0625", "\"radius\": 0.5", 5,
                  "a rounded_box has no such number; it has: shape, contact, half_extents, rounding, friction");
    check_mistake("[0.2, 0.125]", "0.2", 5, "give 2 numbers in brackets");
    check_mistake("outside_box", "inside_box", 8,
                  "no shape; there are: walls, half_space, sphere, box, capsule, outside_box, rounded_box");
    check_mistake("\"contact\": \"slip\"", "\"contact\": \"slide\"", 8, "stick, slip, separate, none");
}

TEST_CASE("a solid that a program does not offer is refused with what it has", "[any]") {
    const auto refused = [](const auto& change, const std::string& says) {
        auto choice = read(text);
        change(std::get<Named>((*choice.boundary)[0]));
        check_refused<parameter_error>([&] { AnySimulation<2>(choice, Few{}); }, says);
    };
    refused([](Named& solid) { solid.shape.shape = "torus"; },
            "no shape 'torus'; it has: half_space, sphere, box, capsule, outside_box, rounded_box.");
    refused([](Named& solid) { solid.shape.numbers[0].name = "size"; },
            "'size' is no parameter of rounded_box; there are: half_extents, rounding.");
    refused([](Named& solid) { solid.shape.numbers[0].values = {1}; },
            "The parameter half_extents of rounded_box has 2 numbers; 1 are given.");
    refused([](Named& solid) { solid.shape.numbers[1].values = {}; },
            "The parameter rounding of rounded_box has 1 number; 0 are given.");
    refused(
        [](Named& solid) {
            solid.shape.numbers.pop_back();
            solid.shape.numbers[0].values[1] = 0.01;
        },
        "The rounding of a rounded box is 0.02 m");
    refused([](Named& solid) { solid.friction = -1; }, "friction");
}

}  // namespace own_shape_tests
