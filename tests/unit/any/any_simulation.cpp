// quick: no
/// \file Simulations chosen at run time: bit for bit those that are chosen at compile time, and what a program may ask
/// of them.
#include "support/effort.hpp"
#include "support/message.hpp"
#include <firn/any/run_of.hpp>
#include <firn/any_simulation.hpp>
#include <firn/simulation.hpp>

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace any_simulation_tests {
namespace {

using namespace firn;
using test_support::check_refused;

using Two = OfferedMaterials<FixedCorotated, Sand>;
using Few = Offer<Two, OfferedTransfers<Apic>>;
using Few3D = Offer<Two, OfferedTransfers<Apic, Aflip<>>, OfferedPrecisions<double>>;
template <int D>
using FewIn = std::conditional_t<D == 2, Few, Few3D>;

template <int D>
Vec<double, D> point(double x, double y, double z = 0.5) {
    Vec<double, D> p{};
    p[0] = x;
    p[1] = y;
    if constexpr (D == 3) p[2] = z;
    return p;
}
template <int D>
Domain<D> box() {
    return {Vec<double, D>::zero(), Vec<double, D>::filled(1), 1. / 16};
}
template <int D>
Samples<D> cube(double x, double y) {
    return sample_box<D>(point<D>(x, y, 0.4), point<D>(x + 0.2, y + 0.2, 0.6), {.spacing = 1. / 32});
}
template <int D>
Collider<Sphere<double, D>> ball() {
    Collider<Sphere<double, D>> ball;
    ball.shape.radius = 0.2;
    ball.position = point<D>(0.45, 0.2);
    ball.linear_velocity = point<D>(0.5, 0.25, 0);
    ball.friction = 0.25;
    return ball;
}
template <int D>
SimulationChoice<D> two_materials(const std::string& precision, const std::string& transfer) {
    SimulationChoice<D> choice;
    choice.domain = box<D>();
    choice.precision = precision;
    choice.transfer = transfer;
    choice.materials = {{"sand", {{"young", 2e4}, {"friction_angle", 30}}, {{"hardening_decay", 0.5}}},
                        {"fixed_corotated", {{"young", 1e4}, {"poisson", 0.25}}, {}}};
    choice.boundary = {ball<D>(),
                       Walls<double, D>::all(choice.domain.lower, choice.domain.upper, {Contact::slip, 0.5})};
    choice.threads = 2;
    return choice;
}
template <int D>
AnySimulation<D> with_cubes(const SimulationChoice<D>& choice) {
    AnySimulation<D> simulation(choice, FewIn<D>{});
    simulation.add(0, cube<D>(0.4, 0.45), 1500, point<D>(0.1, -1, 0));
    simulation.add(1, cube<D>(0.3, 0.7), 1000, point<D>(0, -2, 0));
    return simulation;
}

/// The two cubes of two_materials(), with types.
template <int D, class S, class Transfer>
auto typed_cubes() {
    SandProperties grains;
    grains.young = 2e4;
    grains.friction_angle = degrees(30);
    auto sand = Sand<S>::from_properties(grains);
    sand.hardening_decay = S(0.5);
    const auto walls = Walls<S, D>::all(box<D>().lower, box<D>().upper, {Contact::slip, 0.5});
    SimulationWith<D, Materials<FixedCorotated<S>, Sand<S>>, Together<Walls<S, D>, Collider<Sphere<S, D>>>, Transfer>
        simulation(box<D>(), {FixedCorotated<S>::from_young_poisson(1e4, 0.25), sand}, Coloured{2},
                   Together(walls, lift<S>(ball<D>())));
    simulation.template set<1>().add(cube<D>(0.4, 0.45), 1500, point<D>(0.1, -1, 0));
    simulation.template set<0>().add(cube<D>(0.3, 0.7), 1000, point<D>(0, -2, 0));
    return simulation;
}

template <class S>
bool same_fields(const AnyState& any, const State<S>& typed) {
    const auto& state = std::get<State<S>>(any);
    return state.fields == typed.fields && state.id == typed.id && state.time == typed.time;
}
/// Runs both and compares all fields of both sets.
template <int D, class S, class Transfer>
void check_bits() {
    const char* const precision = std::same_as<S, float> ? "float" : "double";
    auto any = with_cubes(two_materials<D>(precision, Transfer::name));
    auto typed = typed_cubes<D, S, Transfer>();
    any.measure_reactions();
    typed.reactions.emplace();
    any.advance(0.1);
    typed.advance(0.1);
    CAPTURE(D, precision, Transfer::name);
    CHECK(any.steps() > 10);
    CHECK(same_fields(any.state(0), state_of(typed.template set<1>())));
    CHECK(same_fields(any.state(1), state_of(typed.template set<0>())));
    for (const std::size_t part : {0u, 1u}) {  // the other way round, with types
        const Vec<double, D> impulse = typed.reactions->parts[1 - part].impulse;
        CHECK(any.reaction(part).impulse[1] == impulse[1]);
    }
    CHECK(any.reaction(0).impulse[1] > 0);
    const auto moved = std::get<Collider<Sphere<double, D>>>(any.boundary_part(0));
    CHECK(moved.position[0] == std::get<1>(typed.boundary.parts).position[0]);
    CHECK(moved.position[0] > 0.49);
}

}  // namespace

TEST_CASE("a simulation chosen at run time has the bits of the one chosen at compile time", "[any]") {
    check_bits<2, float, Apic>();
    check_bits<2, double, Apic>();
    check_bits<3, double, Apic>();
    check_bits<3, double, Aflip<>>();
}

TEST_CASE("one material of an offer has the bits of a simulation without the others", "[any]") {
    SimulationChoice<2> choice;
    choice.domain = box<2>();
    choice.materials = {{"sand", {{"young", 2e4}, {"friction_angle", 30}}, {}}};
    choice.threads = 1;
    AnySimulation<2> any(choice, Few{});
    SandProperties grains;
    grains.young = 2e4;
    grains.friction_angle = degrees(30);
    Simulation typed(box<2>(), Sand<float>::from_properties(grains), Coloured{1});
    any.add(0, cube<2>(0.4, 0.1), 1500);
    typed.add(cube<2>(0.4, 0.1), 1500);
    any.advance(0.2);
    typed.advance(0.2);
    CHECK(any.steps() == typed.steps());
    CHECK(same_fields(any.state(0), state_of(typed)));

    // A copy of its set goes on in a simulation of the same types.
    using Set = MaterialSet<2, Sand<float>>;
    const auto* const set = dynamic_cast<const Set*>(std::get<const SetOf<float, 2>*>(any.stored_set(0)));
    REQUIRE(set);
    Simulation copy(box<2>(), Sand<float>{}, Coloured{1});
    copy.restore(Set(*set), {any.time(), any.steps(), any.last_time_step()});
    copy.advance(0.05);
    typed.advance(0.05);
    CHECK(same_fields(state_of(copy), state_of(typed)));
    CHECK_THROWS_AS(any.stored_set(1), parameter_error);
}

TEST_CASE("the order of a boundary's parts changes no bit", "[any]") {
    SimulationChoice<2> choice = two_materials<2>("float", "apic");
    Collider<HalfSpace<double, 2>> slope;
    slope.shape.outward = {0.6, 0.8};
    slope.position = {0.1, 0.2};
    slope.friction = 0.5;
    Collider<Box<double, 2>> box;
    box.shape.half_extents = {0.1, 0.15};
    box.position = {0.75, 0.2};
    box.rotation = rotor(degrees(20));
    auto other = ball<2>();
    other.position = {0.65, 0.3};
    other.linear_velocity = {-0.5, 0};
    choice.boundary->insert(choice.boundary->end(), {slope, box, other});
    std::vector<std::size_t> order(choice.boundary->size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::vector<State<float>> first;
    int orders = 0;
    do {
        SimulationChoice<2> shuffled = choice;
        for (std::size_t k = 0; k < order.size(); ++k) (*shuffled.boundary)[k] = (*choice.boundary)[order[k]];
        auto any = with_cubes(shuffled);
        any.warn() = nullptr;
        any.advance(0.15);
        std::vector<State<float>> now{std::get<State<float>>(any.state(0)), std::get<State<float>>(any.state(1))};
        if (first.empty()) first = now;
        CAPTURE(order);
        CHECK(now[0].fields == first[0].fields);
        CHECK(now[1].fields == first[1].fields);
        ++orders;
    } while (std::next_permutation(order.begin(), order.end()) && orders < test_support::fewer_if_quick(120, 12));
}

TEST_CASE("fields are read and written in the order of ids", "[any]") {
    auto any = with_cubes(two_materials<2>("float", "apic"));
    any.advance(0.05);
    const auto state = std::get<State<float>>(any.state(0));
    const std::vector<std::uint32_t> ids = any.ids(0);
    REQUIRE(std::equal(ids.begin(), ids.end(), state.id.begin(), state.id.end()));
    for (const char* const name :
         {"position", "velocity", "deformation_gradient", "kirchhoff_stress", "plastic_strain"}) {
        std::vector<float> values(state.size() * std::size_t(any.components(0, name)));
        any.read(0, name, std::span(values));
        CAPTURE(name);
        CHECK(values == state.field(name).values);
    }
    std::vector<double> velocities(2 * any.particles(0));
    for (std::size_t i = 0; i < velocities.size(); ++i) velocities[i] = 0.001 * double(i);
    any.write(0, "velocity", std::span<const double>(velocities));
    std::vector<double> again(velocities.size());
    any.read(0, "velocity", std::span(again));
    double error = 0;
    for (std::size_t i = 0; i < again.size(); ++i) error = std::max(error, std::abs(again[i] - velocities[i]));
    CHECK(error <= 1e-7);
    double momentum = 0;
    for (std::size_t i = 0; i < velocities.size(); i += 2) momentum += velocities[i];
    CHECK(any.totals(0).momentum[0] == Approx(momentum * any.totals(0).mass / double(any.particles(0))).epsilon(1e-6));
    std::vector<float> positions(2 * any.particles(0)), moved(positions.size());
    any.read(0, "position", std::span(positions));
    for (float& x : positions) x = 0.5F + 0.25F * x;
    any.write(0, "position", std::span<const float>(positions));
    any.read(0, "position", std::span(moved));
    for (std::size_t i = 0; i < moved.size(); ++i) error = std::max(error, double(std::abs(moved[i] - positions[i])));
    CHECK(error <= 1e-7);
    any.step();  // takes the new velocities and places
    check_refused<parameter_error>([&] { any.read(0, "velocity", std::span(again).first(3)); },
                                   "memory for 3 is given");
    check_refused<parameter_error>([&] { any.read(0, "speed", std::span(again)); },
                                   "they have: position, place, velocity");
    again[5] = std::numeric_limits<double>::quiet_NaN();
    check_refused<parameter_error>([&] { any.write(0, "velocity", std::span<const double>(again)); }, "must be finite");
}

TEST_CASE("a run chosen at run time goes on from its state to the bit, and from another precision", "[any]") {
    auto one = with_cubes(two_materials<2>("float", "apic"));
    one.advance(0.05);
    auto copy = one;
    AnySimulation<2> other(two_materials<2>("float", "apic"), Few{});
    for (const std::size_t k : {0u, 1u}) other.restore(k, one.state(k));
    for (auto* const run : {&one, &copy, &other}) run->advance(0.05);
    for (const std::size_t k : {0u, 1u}) {
        const AnyState expected = one.state(k);
        CHECK(same_fields(copy.state(k), std::get<State<float>>(expected)));
        CHECK(same_fields(other.state(k), std::get<State<float>>(expected)));
    }
    AnySimulation<2> exact(two_materials<2>("double", "apic"), Few{});
    check_refused<io_error>([&] { exact.restore(0, one.state(0)); }, "for precision");
    for (const std::size_t k : {0u, 1u}) exact.restore(k, one.state(k), Restart::converted);
    CHECK(exact.time() == one.time());
    CHECK(exact.totals(0).kinetic_energy == Approx(one.totals(0).kinetic_energy).epsilon(1e-5));
    exact.step();
}

TEST_CASE("a run in float takes from a state in double what float can hold", "[any]") {
    auto exact = with_cubes(two_materials<2>("double", "apic"));
    exact.advance(0.05);
    const auto from = std::get<State<double>>(exact.state(1));
    AnySimulation<2> rounded(two_materials<2>("float", "apic"), Few{});
    rounded.restore(1, from, Restart::converted);
    const auto to = std::get<State<float>>(rounded.state(1));
    const auto &F = from.field("deformation_gradient").values,
               &less_one = from.field("deformation_gradient_remainder").values;
    const auto &of_float = to.field("deformation_gradient").values,
               &remainder = to.field("deformation_gradient_remainder").values;
    bool all = true;
    for (std::size_t i = 0; i < to.size(); ++i)  // F - 1, rounded once
        for (std::size_t a = 0; a < 2; ++a)
            all = all && (of_float[4 * i + 3 * a] - 1) + remainder[2 * i + a] ==
                             float((F[4 * i + 3 * a] - 1) + less_one[2 * i + a]);
    CHECK(all);
}

TEST_CASE("materials, boundaries and bodies change while a chosen simulation runs", "[any]") {
    auto any = with_cubes(two_materials<2>("double", "apic"));
    CHECK(any.set("fixed_corotated") == 1);
    CHECK(any.bodies(1).size() == 1);
    const auto mu = [&] { return any.material(1)[0].values[0]; };
    CHECK(mu() == 1e4 / 2.5);
    any.edit_material(1, {{"mu", 8e3}});
    CHECK(mu() == 8e3);
    check_refused<parameter_error>([&] { any.edit_material(1, {{"mu", -1}}); }, "mu");
    CHECK(mu() == 8e3);
    auto slow = ball<2>();
    slow.linear_velocity = {0, 0};
    slow.position = {0.5, 0.1};
    any.set_boundary_part(0, slow);
    any.advance(0.02);
    CHECK(std::get<Collider<Sphere<double, 2>>>(any.boundary_part(0)).position[1] == 0.1);
    CHECK(std::get<Collider<Sphere<double, 2>>>((*any.choice().boundary)[0]).position[1] == 0.1);
    check_refused<parameter_error>([&] { any.set_boundary_part(1, slow); }, "keeps its shape");
    CHECK(any.remove_if(0, [](const auto& x, std::uint32_t) { return x[0] > 0.5; }) == 18);
    CHECK(any.particles(0) == 18);
    Source<2> source;
    source.samples = cube<2>(0.1, 0.7);
    source.density = 1000;
    source.rate = 1000;
    source.start = any.time();
    source.end = any.time() + 1e-3;
    any.add_source(1, source);
    any.set_fixed_time_step(1e-4);
    const std::size_t before = any.particles(1);
    any.advance(0.002);
    CHECK(any.particles(1) == before + source.samples.positions.size());
    CHECK(any.last_time_step() == Approx(1e-4));
    any.add_sink(1, {{0, 0}, {1, 1}});
    any.step();
    CHECK(any.particles(1) == 0);
}

TEST_CASE("a choice that a program does not offer is refused with what it has", "[any]") {
    const auto refused = [](const auto& change, const std::string& text) {
        auto choice = two_materials<2>("float", "apic");
        change(choice);
        check_refused<parameter_error>([&] { AnySimulation<2>(choice, Few{}); }, text);
    };
    refused([](auto& c) { c.materials[0].name = "snow"; }, "no material 'snow'; it has: fixed_corotated, sand.");
    refused([](auto& c) { c.transfer = "pic"; }, "no transfer 'pic'; it has: apic");
    refused([](auto& c) { c.kernel = "linear"; }, "no kernel 'linear'; it has: quadratic_b_spline.");
    refused([](auto& c) { c.force = "none"; }, "no force form 'none'; it has: mls.");
    refused([](auto& c) { c.precision = "half"; }, "no precision 'half'; it has: float, double.");
    refused([](auto& c) { c.materials.clear(); }, "no material");
    refused([](auto& c) { c.materials[0] = c.materials[1]; }, "is there twice");
    refused([](auto& c) { c.materials[0].properties[0].name = "youngs"; },
            "no property of sand; there are: young, poisson");
    refused([](auto& c) { c.materials[0].parameters[0].name = "nu"; }, "no parameter of sand; there are: mu, lambda");
    refused([](auto& c) { c.materials[1].properties[1].value = 0.5; }, "Poisson");
    refused([](auto& c) { c.transfer_parameters = {{"flip_ratio", 1}}; }, "no parameter of apic; there are: none");
    refused([](auto& c) { c.domain.cell_size = 0; }, "The cell size is 0 m");
    refused([](auto& c) { c.boundary->push_back((*c.boundary)[1]); }, "walls twice");
    refused([](auto& c) { std::get<1 + 1>((*c.boundary)[0]).shape.radius = -1; }, "The radius of a sphere is -1 m");
    check_refused<parameter_error>([] { AnySimulation<3>(two_materials<3>("float", "apic"), Few3D{}); },
                                   "no precision 'float'; it has: double.");
    auto any = with_cubes(two_materials<2>("float", "apic"));
    check_refused<parameter_error>([&] { any.particles(2); }, "There is no set 2; the choice has 2 materials.");
    check_refused<parameter_error>([&] { any.set("snow"); }, "No set has the material 'snow'");
    check_refused<parameter_error>([&] { any.boundary_part(2); }, "has no part 2");
    check_refused<usage_error>([&] { any.reaction(0); }, "Reactions are not measured");
    any.measure_reactions();
    check_refused<usage_error>([&] { any.reaction(0); }, "No step has measured");
}

}  // namespace any_simulation_tests
