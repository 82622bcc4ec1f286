/// \file A stored run goes on to the same bits as one that was never stopped; what does not fit is refused.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/message.hpp"
#include "support/scenes.hpp"
#include <firn/io/states.hpp>

#include "example_state.hpp"

using namespace firn;

namespace simulation_state_tests {
namespace {

template <int D, class S, class Execution>
using Run = Simulation<D, FixedCorotated<S>, Apic, MlsForce, QuadraticBSpline, Execution>;

template <int D, class S, class Execution>
Run<D, S, Execution> make_run(int threads) {
    return Run<D, S, Execution>({Vec<double, D>::zero(), Vec<double, D>::filled(1.0), 1.0 / 16},
                                FixedCorotated<S>::from_young_poisson(1e5, 0.3), {threads});
}

template <int D, class S, class Execution>
void check_continuation() {
    const int before = test_support::fewer_if_slow(137, 11), after = test_support::fewer_if_slow(200, 14);
    const states::Folder folder;
    auto whole = make_run<D, S, Execution>(1);
    scenes::add_two_blocks<D>(whole, 0.25, 1.0 / 32);
    for (int i = 0; i < before; ++i) whole.step();
    write_state(folder / "state.hdf", state_of(whole));
    const std::uint64_t at_state = scenes::hash(whole);
    for (int i = 0; i < after; ++i) whole.step();  // writing must not have changed anything, see below

    auto continued = make_run<D, S, Execution>(3);
    restore(continued, read_state<S>(folder / "state.hdf"));
    CHECK(scenes::hash(continued) == at_state);
    CHECK(continued.steps() == std::uint64_t(before));
    for (int i = 0; i < after; ++i) continued.step();
    CHECK(scenes::hash(continued) == scenes::hash(whole));
    CHECK(continued.time() == whole.time());

    auto unwritten = make_run<D, S, Execution>(2);
    scenes::add_two_blocks<D>(unwritten, 0.25, 1.0 / 32);
    for (int i = 0; i < before + after; ++i) unwritten.step();
    CHECK(scenes::hash(unwritten) == scenes::hash(whole));
}

}  // namespace

TEST_CASE("A run that goes on from a state has the bits of one that was never stopped: coloured, 3D, float") {
    check_continuation<3, float, Coloured>();
}
TEST_CASE("A run that goes on from a state has the bits of one that was never stopped: coloured, 2D, double") {
    check_continuation<2, double, Coloured>();
}
TEST_CASE("A run that goes on from a state has the bits of one that was never stopped: fixed point") {
    check_continuation<3, float, FixedPoint<std::int32_t>>();
}

TEST_CASE("A state says what it holds, in SI units, in the order of ids") {
    auto run = make_run<2, double, Coloured>(1);
    const Body first = run.add(sample_box<2>({0.2, 0.2}, {0.3, 0.3}, {.spacing = 1.0 / 32}), 100.0, {0.5, 0.25});
    const Body second = run.add(sample_box<2>({0.6, 0.2}, {0.7, 0.3}, {.spacing = 1.0 / 32}), 200.0);
    const auto state = state_of(run);
    REQUIRE(state.size() == first.count + second.count);
    CHECK(state.field("position").unit == "m");
    CHECK(state.field("velocity").values[0] == 0.5);
    CHECK(state.field("velocity").values[1] == 0.25);
    CHECK(state.field("deformation_gradient").values[3] == 1.0);
    CHECK(state.field("mass").values[0] == Approx(100.0 / 32 / 32));
    CHECK(state.field("mass").values.back() == Approx(200.0 / 32 / 32));
    CHECK(state.body.front() == 0);
    CHECK(state.body.back() == 1);
    for (std::size_t i = 0; i < state.size(); ++i) CHECK(state.id[i] == std::int64_t(i));
}

TEST_CASE("Of few particles that are left of many, too, a state is in the order of ids and a run goes on") {
    auto run = make_run<2, double, Coloured>(1);
    scenes::add_two_blocks<2>(run, 0.25, 1.0 / 32);
    for (int i = 0; i < 5; ++i) run.step();
    const std::uint32_t all = run.particles().next_id();
    run.remove_if([&](const Vec<double, 2>&, std::uint32_t id) { return id != 1 && id != 50 && id != all - 1; });
    const auto state = state_of(run);
    CHECK(state.id == std::vector<std::int64_t>{1, 50, all - 1});
    auto continued = make_run<2, double, Coloured>(3);
    restore(continued, state);
    for (int i = 0; i < 20; ++i) run.step(), continued.step();
    CHECK((state_of(continued) == state_of(run)));
}

TEST_CASE("Where moving boundaries were is in a state to the bit, and comes back from it") {
    using Boundary = Together<Walls<float, 3>, Collider<Sphere<float, 3>>>;
    using Turning = Simulation<3, FixedCorotated<float>, Apic, MlsForce, QuadraticBSpline, Coloured, Boundary>;
    const auto walls = Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::slip, 0});
    const Collider<Sphere<float, 3>> ball{
        .shape = {0.123F}, .linear_velocity = {0.1, 0.2, 0.3}, .angular_velocity = {1.0, 2.0, 3.0}};
    const auto make = [&] {
        return Turning({{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 1.0 / 16}, FixedCorotated<float>{}, {}, {walls, ball});
    };
    auto run = make();
    run.add(sample_box<3>({0.2, 0.2, 0.2}, {0.3, 0.3, 0.3}, {.spacing = 1.0 / 32}), 1000);
    for (int i = 0; i < 7; ++i) run.boundary = advanced(run.boundary, 0.01);
    const states::Folder folder;
    write_state(folder / "state.hdf", state_of(run));
    const auto state = read_state<float>(folder / "state.hdf");
    CHECK(detail::parameter_values(state, "boundary", "1_shape_radius") == std::vector<double>{double(0.123F)});
    auto continued = make();
    restore(continued, state);
    const auto &was = std::get<1>(run.boundary.parts), &is = std::get<1>(continued.boundary.parts);
    CHECK(is.position == was.position);
    CHECK(is.rotation == was.rotation);
    CHECK(is.position[0] == Approx(0.007));
    CHECK(is.shape.radius == 0.123F);
    CHECK_THROWS_AS(restore_parameters(continued.boundary, state, "material"), io_error);
}

namespace {

/// What restore() says against it; the simulation keeps its particles.
template <class Simulation, class S>
std::string refusal(Simulation& target, const State<S>& state, Restart how = Restart::same_bits) {
    const auto before = target.particles().size();
    const std::string said = test_support::message<io_error>([&] { restore(target, state, how); });
    CHECK(target.particles().size() == before);
    return said;
}
bool holds(const std::string& text, const std::string& word) {
    UNSCOPED_INFO(text << " | " << word);
    return test_support::holds(text, word);
}

}  // namespace

TEST_CASE("A state that an earlier firn wrote, of schema_version 2, is read, and a run goes on from it") {
    // Two bodies of four particles, 1/16 m apart, that fly at 0.5 m/s without gravity; after one step of 2^-9 s.
    const auto state = read_state<float>(FIRN_TEST_REFERENCE_DIR "/state_schema_2.hdf");
    CHECK(state.body == std::vector<std::int32_t>{0, 0, 0, 0, 1, 1, 1, 1});
    CHECK(state.last_time_step == 0x1p-9);
    CHECK(state.step == 1);
    CHECK(state.find("note") == nullptr);
    const std::vector<float>& x = state.field("position").values;
    CHECK(x[0] == Approx(0.25 + 1.0 / 32 + 0x1p-10).epsilon(1e-6));
    CHECK(x[14] - x[0] == Approx(0.5 + 1.0 / 16).epsilon(1e-4));  // a wall has begun to hold the second body

    Simulation<2> run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 8});
    restore(run, state, Restart::other_build);
    CHECK(run.fixed_time_step == 0x1p-9);
    REQUIRE(run.bodies().size() == 2);
    run.step();
    CHECK(run.steps() == 2);
    const State<float> after = state_of(run);
    for (std::size_t i = 0; i < 8; i += 2)  // of the body that is far from the walls
        CHECK(after.field("position").values[i] - x[i] == Approx(0x1p-10).epsilon(1e-4));
}

TEST_CASE("A state of another run is refused with what differs, and the simulation is as it was") {
    auto run = make_run<2, double, Coloured>(1);
    scenes::add_two_blocks<2>(run, 0.25, 1.0 / 32);
    const auto state = state_of(run);
    Simulation<2, FixedCorotated<double>, Pic> pic(run.domain());
    CHECK(holds(refusal(pic, state), "this run has 'pic'"));
    auto other_cells = Run<2, double, Coloured>({run.domain().lower, run.domain().upper, 1.0 / 20});
    CHECK(holds(refusal(other_cells, state), "cell_size = 0.0625, that of this run has 0.05"));
    Run<2, double, Coloured> stiffer(run.domain(), FixedCorotated<double>::from_young_poisson(2e5, 0.3));
    CHECK(holds(refusal(stiffer, state), "mu = "));
    auto integers = make_run<2, double, FixedPoint<std::int64_t>>(1);
    CHECK(holds(refusal(integers, state), "'coloured' for execution"));
    auto single = make_run<2, float, Coloured>(1);
    CHECK(holds(refusal(single, state), "'double' for precision"));
    for (const std::string changed : {"compiler", "instruction_set", "library_version"}) {
        auto elsewhere = state;
        for (auto& attribute : elsewhere.attributes)
            if (attribute.name == changed) attribute.value = "of another machine";
        CHECK(holds(refusal(run, elsewhere), "'of another machine' for " + changed));
        CHECK(holds(refusal(run, elsewhere), "Restart::other_build"));
        restore(run, elsewhere, Restart::other_build);
    }
}

TEST_CASE("A damaged state is refused, and the simulation is as it was") {
    auto run = make_run<2, double, Coloured>(1);
    scenes::add_two_blocks<2>(run, 0.25, 1.0 / 32);
    const auto state = state_of(run);
    const auto damaged = [&](const char* word, const auto& damage) {
        auto wrong = state;
        damage(wrong);
        CHECK(holds(refusal(run, wrong), word));
    };
    damaged("order of particles", [](auto& s) { s.tables[0].values[3] = s.tables[0].values[4]; });
    damaged("order of particles", [](auto& s) { s.id[1] = 0; });
    damaged("blocks", [](auto& s) { s.tables[1].values[0] = 1 << 30; });
    damaged("blocks", [](auto& s) { s.tables[1].values[0] = std::numeric_limits<std::int64_t>::min(); });
    damaged("bodies", [](auto& s) { s.tables[2].values[1] = std::int64_t(1) << 40; });
    damaged("bodies", [](auto& s) { s.tables[2].values[0] = -1; });
    damaged("bodies", [](auto& s) { s.tables.clear(); });
    damaged("velocity", [](auto& s) { s.fields[2].values[5] = std::numeric_limits<double>::infinity(); });
    damaged("place or position", [](auto& s) { s.fields[0].values[5] += 1e-6; });
    damaged("mass", [](auto& s) { s.fields[5].values[5] = -1; });
    damaged("deformation_gradient_remainder", [](auto& s) { s.fields.back().values[1] = 0.5; });
    damaged("deformation_gradient_remainder", [](auto& s) { s.fields.back().components = 1; });
    damaged("no field 'deformation_gradient'", [](auto& s) { s.fields.erase(s.fields.end() - 2); });
}

TEST_CASE("A state holds strains that its deformation gradients cannot, and a run goes on from it with the same bits") {
    const auto make = [] {
        Simulation<2> run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, FixedCorotated<float>::from_young_poisson(1e9, 0.3));
        run.fixed_time_step = 1e-5;
        return run;
    };
    auto run = make();
    const Body body = run.add(sample_box<2>({0.3, 0.3}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000);
    run.set_states(body, [](const auto& x, auto& state) {
        const float strain = 1e-9F + 1e-8F * float(x[0]);
        state.F = DeformationGradient<float, 2>::from_displacement(Mat<float, 2>::rows(strain, 0, 0, -strain));
    });
    run.step();
    const states::Folder folder;
    write_state(folder / "state.hdf", state_of(run));
    const auto state = read_state<float>(folder / "state.hdf");
    const StateField<float>& remainder = state.field("deformation_gradient_remainder");
    CHECK(remainder.components == 2);
    const auto F = state.field("deformation_gradient").values;
    CHECK(F[0] == 1);
    const auto slot = slots_by_id(run.particles(), 1)[0];
    CHECK(remainder.values[0] == displacement_gradient(run.particles().state(slot).F)(0, 0));
    CHECK(remainder.values[0] != 0);

    auto continued = make();
    restore(continued, state);
    for (int i = 0; i < 50; ++i) run.step(), continued.step();
    CHECK((state_of(continued) == state_of(run)));

    // Of a state without remainders, as schema_version 4 had it, they are 0.
    auto old = state;
    std::erase_if(old.fields, [](const auto& field) { return field.name == "deformation_gradient_remainder"; });
    restore(continued, old);
    for (std::size_t i = 0; i < continued.particles().slots(); ++i)
        if (continued.particles().is_particle(i))
            REQUIRE(displacement_gradient(continued.particles().state(i).F)(0, 0) == 0);

    // In double they count, too.
    Simulation<2, FixedCorotated<double>> in_double({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16});
    restore(in_double, state, Restart::converted);
    CHECK(displacement_gradient(in_double.particles().state(slots_by_id(in_double.particles(), 1)[0]).F)(0, 0) ==
          double(remainder.values[0]));
}

TEST_CASE("The remainders of a field are written with it") {
    const StateOptions chosen{.fields = {"deformation_gradient"}};
    CHECK(chosen.writes("deformation_gradient_remainder"));
    CHECK_FALSE(chosen.writes("volume_ratio_remainder"));
    CHECK_FALSE(chosen.writes("_remainder"));
}

TEST_CASE("A restart takes over gravity, the time step and the sorting of the run") {
    auto run = make_run<2, double, Coloured>(1);
    scenes::add_two_blocks<2>(run, 0.25, 1.0 / 32);
    run.gravity = {0.5, -2.0};
    run.fixed_time_step = 1e-4;
    run.most_steps_between_sorts = 7;
    auto continued = make_run<2, double, Coloured>(1);
    restore(continued, state_of(run));
    CHECK(continued.gravity == run.gravity);
    CHECK(continued.fixed_time_step == 1e-4);
    CHECK(continued.most_steps_between_sorts == 7);
}

TEST_CASE("Converted: a run in float goes on in double, with another transfer, kernel and stiffness") {
    auto run = make_run<2, float, Coloured>(1);
    scenes::add_two_blocks<2>(run, 0.25, 1.0 / 32);
    for (int i = 0; i < 20; ++i) run.step();
    const auto state = state_of(run);
    using Other = Simulation<2, FixedCorotated<double>, Pic, MlsForce, CubicBSpline, Coloured>;
    Other other({run.domain().lower, run.domain().upper, 1.0 / 20},
                FixedCorotated<double>::from_young_poisson(2e5, 0.3));
    CHECK(holds(refusal(other, state), "cubic"));
    CHECK(holds(refusal(other, state, Restart::other_build), "cubic"));
    restore(other, state, Restart::converted);
    CHECK(other.steps() == 20);
    CHECK(other.time() == run.time());
    CHECK(other.bodies().size() == 2);
    const auto before = run.totals(), after = other.totals();
    CHECK(after.particles == before.particles);
    CHECK(after.mass == Approx(before.mass).epsilon(1e-12));
    CHECK(norm(after.momentum - before.momentum) < 1e-12 * before.mass);
    // Twice as stiff; its moduli were rounded to float before.
    CHECK(after.elastic_energy == Approx(2 * before.elastic_energy).epsilon(1e-6));
    const auto converted = state_of(other);
    CHECK(converted.id == state.id);
    for (std::size_t k = 0; k < state.field("position").values.size(); ++k)
        REQUIRE(converted.field("position").values[k] ==
                Approx(double(state.field("position").values[k])).margin(1e-15));
    for (int i = 0; i < 20; ++i) other.step();

    auto less = state;
    std::erase_if(less.fields, [](const auto& field) { return field.name == "affine_velocity"; });
    restore(other, less, Restart::converted);
    const auto without = state_of(other);
    for (const double number : without.field("affine_velocity").values) REQUIRE(number == 0);
    std::erase_if(less.fields, [](const auto& field) { return field.name == "deformation_gradient"; });
    CHECK(holds(refusal(other, less, Restart::converted), "no field 'deformation_gradient'"));
    const Domain<2> elsewhere{{0.0, 0.0}, {0.4, 0.4}, 1.0 / 40};
    Other too_small(elsewhere);
    CHECK_THROWS_AS(restore(too_small, state, Restart::converted), particle_error);
}

}  // namespace simulation_state_tests
