// What a program says of itself: buffers, uniforms and dispatch within the limits of WebGPU, or a sentence.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include "support/share_of_apic.hpp"
#include <firn/field/attraction.hpp>
#include <firn/field/damped.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/snow.hpp>
#include <firn/transfer/aflip.hpp>
#include <firn/transfer/flip.hpp>
#include <firn/transfer/fmpm.hpp>
#include <firn/volumetric/f_bar.hpp>
#include <firn/volumetric/volume_filter.hpp>
#include <firn/wgsl/inputs.hpp>
#include <firn/wgsl/manifest.hpp>
#include <firn/wgsl/program.hpp>

#include "wgsl/asking.hpp"

using namespace firn;
using test_support::ShareOfApic;

namespace {

template <int D>
wgsl::Program program() {
    return wgsl::make_program<QuadraticBSpline, Apic, MlsForce, D>(
        FixedCorotated<float>{}, Walls<float, D>::all(Vec<float, D>::zero(), Vec<float, D>::filled(1), {}),
        Attraction<float, D>{});
}

std::string message(const std::function<void()>& body) {
    try {
        body();
    } catch (const error& e) {
        return e.what();
    }
    return {};
}

float float_at(const std::vector<std::byte>& bytes, std::size_t offset) {
    float x = 0;
    std::memcpy(&x, bytes.data() + offset, sizeof x);
    return x;
}

}  // namespace

TEST_CASE("Uniforms lie where WGSL's rules of alignment put them") {
    // WGSL, "Alignment and Size": f32 and u32 4, vec2 8, vec3 16 bytes; a vec3 takes 12.
    wgsl::Program shifted;
    wgsl::detail::UniformLayout layout(shifted);
    for (const int components : {1, 3, 1, 1, 2, 1, 3})
        layout.add("u" + std::to_string(components), "", "", "", std::vector<double>(std::size_t(components)));
    std::vector<std::size_t> offsets;
    for (const wgsl::Uniform& u : shifted.uniforms) offsets.push_back(u.offset);
    CHECK(offsets == std::vector<std::size_t>{0, 16, 28, 32, 40, 48, 64});
    for (const wgsl::Program& p : {program<2>(), program<3>()}) {
        std::size_t end = 0;
        for (const wgsl::Uniform& u : p.uniforms) {
            const std::size_t n = u.values.size(), align = n == 1 ? 4 : n == 2 ? 8 : 16;
            CHECK(u.offset % align == 0);
            CHECK(u.offset >= end);
            CHECK(u.offset < end + align);
            end = u.offset + 4 * n;
        }
        CHECK(p.uniform_bytes >= end);
        CHECK(p.uniform_bytes % 16 == 0);
    }
}

TEST_CASE("No kernel needs more than eight storage buffers, and all that it binds exists") {
    for (const wgsl::Program& p : {program<2>(), program<3>()})
        for (const wgsl::EntryPoint& e : p.entry_points) {
            INFO(e.name);
            CHECK(e.bindings.size() - 1 <= 8);
            CHECK(p.code.find("fn " + e.name + "(") != std::string::npos);
            for (const auto& [binding, writes] : e.bindings)
                CHECK((binding == 0 || std::any_of(p.buffers.begin(), p.buffers.end(),
                                                   [&](const wgsl::Buffer& b) { return b.binding == binding; })));
        }
}

TEST_CASE("Particles or nodes beyond a limit are refused with the limit's name and the number that fits") {
    const wgsl::Program p = program<3>();
    // The widest buffers hold nine numbers a particle: 128 MiB / 36 bytes.
    const std::uint64_t fit = (128ULL << 20) / 36;
    CHECK_NOTHROW(wgsl::check_fits(p, fit, {64, 64, 64}));
    const std::string text = message([&] { wgsl::check_fits(p, fit + 1, {64, 64, 64}); });
    CHECK(text.find("maxStorageBufferBindingSize") != std::string::npos);
    CHECK(text.find(std::to_string(fit) + " particles fit") != std::string::npos);
    CHECK_NOTHROW(wgsl::check_fits(p, 1000, {200, 200, 200}));
    CHECK(message([&] { wgsl::check_fits(p, 1000, {208, 208, 208}); }).find("nodes fit") != std::string::npos);
    CHECK(message([&] {
              wgsl::check_fits(p, 1000, {64, 64, 64}, {.storage_buffers_per_stage = 4});
          }).find("maxStorageBuffersPerShaderStage") != std::string::npos);
}

TEST_CASE("A dispatch beyond 65,535 workgroups goes on in the second dimension") {
    CHECK(wgsl::dispatch(65535 * 64, 64).y == 1);
    for (const std::uint64_t n : {65535ULL * 64 + 1, 5'000'000ULL, 1ULL << 31}) {
        const wgsl::Dispatch d = wgsl::dispatch(n, 64);
        CHECK(d.x <= 65535);
        CHECK(d.y > 1);
        CHECK(std::uint64_t(d.x) * d.y * 64 >= n);
        CHECK(std::uint64_t(d.x) * (d.y - 1) * 64 < n);
    }
    CHECK_THROWS_AS(wgsl::dispatch(1ULL << 40, 64), parameter_error);
}

TEST_CASE("Inputs hold the particles' numbers, and the time step in all that follows from it") {
    Domain<3> domain;
    domain.cell_size = 1.0 / 32;
    Simulation<3> simulation(domain);
    scenes::add_two_blocks<3>(simulation, 0.2, 1.0 / 32);
    simulation.step();
    const wgsl::Program p = program<3>();
    wgsl::Inputs inputs = wgsl::make_inputs<3>(p, domain, simulation.particles(), 1e-4);
    REQUIRE(inputs.particles == simulation.particles().size());
    const auto& motion = inputs.buffers.front();
    REQUIRE(motion.first == "motion");
    std::size_t i = 0;
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot) {
        if (!simulation.particles().is_particle(slot)) continue;
        const Vec<double, 3> x = simulation.particles().exact_position(slot);
        for (std::size_t a = 0; a < 3; ++a) {
            const double cells =
                double(motion.second[a * inputs.particles + i]) + double(motion.second[(a + 3) * inputs.particles + i]);
            REQUIRE(cells / 32 == Approx(x[int(a)]).epsilon(1e-12));
        }
        ++i;
    }
    wgsl::set_time_step(inputs, 2e-4, domain.cell_size);
    const auto bytes = inputs.uniform_bytes();
    CHECK(float_at(bytes, p.uniform("time_step").offset) == 2e-4F);
    CHECK(float_at(bytes, p.uniform("place_per_velocity").offset) == float(2e-4 * 32));
    CHECK(float_at(bytes, p.uniform("boundary_upper").offset + 8) == 1.0F);
    CHECK_THROWS_AS(inputs.set("gravity", {0, 0, 0}), usage_error);
    CHECK_THROWS_AS(inputs.set("time_step", {0, 0, 0}), usage_error);
}

namespace {
/// A boundary that acts with a drag [kg/s].
template <scalar S>
struct Drag {
    static constexpr const char* name = "drag";
    S rate = S(0.5);
    static constexpr auto parameters() { return std::tuple{parameter{"rate", "kg/s", &Drag::rate}}; }
    template <int D>
    Vec<S, D> velocity(const Vec<S, D>&, const Vec<S, D>& v, const S& mass, const S& dt) const {
        return v * (S(1) / (S(1) + rate * dt / mass));
    }
    template <int D>
    bool reaches(const Vec<double, D>&, const Vec<double, D>&) const {
        return true;
    }
};
}  // namespace

TEST_CASE("The parameters of a transfer are uniforms, and a boundary may act with a force") {
    const wgsl::Program p = wgsl::make_program<QuadraticBSpline, ShareOfApic<float>, MlsForce, 2>(
        FixedCorotated<float>{}, Drag<float>{}, Gravity<float, 2>{}, {}, ShareOfApic<float>{0.25F});
    CHECK(p.uniform("transfer_share").values == std::vector<double>{0.25});
    const auto body_of = [&](const std::string& name) {
        const std::size_t first = p.code.find("fn " + name + "(");
        return p.code.substr(first, p.code.find("\n}", first) - first);
    };
    CHECK(body_of("take_from_grid").find("* params.transfer_share") != std::string::npos);
    const std::string update = body_of("velocity_of_node");
    CHECK(update.find("params.boundary_rate * chosen.time_step / ") != std::string::npos);
    wgsl::Inputs inputs(p);
    wgsl::set_parameters(inputs, ShareOfApic<float>{0.75F}, "transfer");
    CHECK(float_at(inputs.uniform_bytes(), p.uniform("transfer_share").offset) == 0.75F);
}

// Drivers may fuse, regroup and round otherwise what is written with operators. Numbers: benchmarks/README.md, "On a
// GPU".
TEST_CASE("Exact programs have calls in place of products, quotients and roots", "[wgsl]") {
    const auto make = [](wgsl::Arithmetic arithmetic) {
        return wgsl::make_program<QuadraticBSpline, Apic, WeightGradientForce, 3>(
            Snow<float>{}, Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {}), Attraction<float, 3>{}, OwnVolume{},
            {.arithmetic = arithmetic});
    };
    const wgsl::Program plain = make(wgsl::Arithmetic::plain), exact = make(wgsl::Arithmetic::exact);
    const auto recorded = [](const wgsl::Program& p) {  // the functions from the definitions
        const std::size_t begin = p.code.find("fn base_node_of"), end = p.code.find("fn inverse");
        return p.code.substr(begin, p.code.find("fn product") < end ? p.code.find("fn product") - begin : end - begin);
    };
    for (const char* of_driver : {" * ", " / ", "sqrt(", "fma("}) {
        INFO(of_driver);
        CHECK(recorded(plain).find(of_driver) != std::string::npos);
        CHECK(recorded(exact).find(of_driver) == std::string::npos);
    }
    for (const char* call : {"product(", "quotient(", "root("}) {
        CHECK(recorded(exact).find(call) != std::string::npos);
        CHECK(plain.code.find(call) == std::string::npos);
    }
    CHECK(std::signbit(exact.uniform("negative_zero").values.at(0)));
    CHECK_THROWS_AS(plain.uniform("negative_zero"), usage_error);
    CHECK(exact.name == plain.name + "_exact");
    CHECK(wgsl::manifest(exact).find("\"default\": -0") != std::string::npos);
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("Exact programs keep sums apart that have a term in common", "[wgsl]") {
    wgsl::Module module(wgsl::Arithmetic::exact);
    using R = wgsl::recorded;
    const auto function = [&](const std::string& name, const auto& f) {
        module.function<R, R, R>(name, "", {"a", "b", "c"}, f);
    };
    function("twice", [](R a, R b, R) { return (a + b) - a; });
    function("far", [](R a, R b, R c) { return (a + b) + (c - (-a)); });
    function("none", [](R a, R b, R c) { return (a + b) + c; });
    const std::string text = module.text();
    CHECK(text.find("= max(a + b, -3e+38f) - a;") != std::string::npos);
    CHECK(text.find("max(a + b, -3e+38f) + max(c - ") != std::string::npos);
    CHECK(text.find("= a + b + c;") != std::string::npos);
}
#endif

TEST_CASE("The parameters of each of several boundaries are uniforms, which follow a solid that moves") {
    using Ball = Collider<Sphere<float, 2>>;
    Together boundary(Walls<float, 2>::all({0, 0}, {1, 1}, {}), Ball{.shape = {0.25F}},
                      Ball{.linear_velocity = {1.0, 2.0}, .angular_velocity = 3.0});
    const wgsl::Program p = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(FixedCorotated<float>{}, boundary);
    CHECK(p.boundary == "walls_collider_sphere_collider_sphere");
    CHECK(p.uniform("boundary_0_upper").values == std::vector<double>{1, 1});
    CHECK(p.uniform("boundary_1_shape_radius").values == std::vector<double>{0.25});
    CHECK(p.uniform("boundary_2_rotation").values == std::vector<double>{1, 0});
    std::vector<std::string> names;
    for (const wgsl::Uniform& u : p.uniforms) names.push_back(u.name);
    std::sort(names.begin(), names.end());
    CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());

    wgsl::Inputs inputs(p);
    boundary = advanced(boundary, 0.1);
    set_parameters(inputs, boundary, "boundary");
    const auto bytes = inputs.uniform_bytes();
    CHECK(float_at(bytes, p.uniform("boundary_2_position").offset + 4) == 0.2F);
    CHECK(float_at(bytes, p.uniform("boundary_2_rotation").offset + 4) == Approx(std::sin(0.15)));
    CHECK(float_at(bytes, p.uniform("boundary_1_shape_radius").offset) == 0.25F);
    CHECK_THROWS_AS(set_parameters(inputs, boundary, "field"), usage_error);
}

TEST_CASE("Mirrored walls act in a pass for each axis and part, after the grid update; other programs have none") {
    auto walls = Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::slip, 0.1});
    walls.at_upper[2].contact = Contact::none;
    const auto make = [](const auto& boundary) {
        return wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 3>(FixedCorotated<float>{}, boundary);
    };
    const wgsl::Program held = make(walls);
    CHECK(held.mirrors.empty());
    using Names = std::vector<std::string>;
    CHECK(wgsl::step_order_of(held) == Names{"begin_step", "clear", "sort", "measure", "measure_counts", "choose_scale",
                                             "p2g", "grid_update", "g2p"});
    CHECK(wgsl::step_order_of(held, true) == Names{"begin_step", "clear", "sort", "clear_bins", "count_cells",
                                                   "place_cells", "measure_loads", "choose_scale", "order_particles",
                                                   "p2g_blocks", "grid_update", "g2p"});
    CHECK(wgsl::entry_points_of(held, "filter volumes").empty());
    CHECK(wgsl::entry_points_of(held, "contact").empty());
    for (const std::string& text : {held.code, wgsl::manifest(held)}) CHECK(text.find("mirror") == std::string::npos);

    walls.nodes_behind = NodesBehind::mirrored;
    auto inner = walls;
    inner.lower = {0.25, 0.25, 0.25};
    const wgsl::Program p = make(Together(walls, inner));
    REQUIRE(p.mirrors.size() == 10);
    CHECK(p.mirrors[1].position == 1);
    CHECK(p.mirrors[1].plane.inward == -1);
    CHECK(p.mirrors[9].plane.axis == 2);
    CHECK(p.mirrors[9].plane.part == 1);
    for (const bool sorted : {false, true}) {
        const std::vector<std::string> order = wgsl::step_order_of(p, sorted);
        const auto first = std::find(order.begin(), order.end(), "grid_update");
        REQUIRE(order.end() - first == 8);
        CHECK(std::vector<std::string>(first, order.end()) ==
              std::vector<std::string>{"grid_update", "mirror_0", "mirror_1", "mirror_2", "mirror_3", "mirror_4",
                                       "mirror_5", "g2p"});
    }
    std::string axes;
    for (const wgsl::EntryPoint& e : p.entry_points)
        if (e.name.starts_with("mirror_")) axes += e.per[0];
    CHECK(axes == "xyzxyz");
    CHECK(p.code.find("let wall_0 = node_of_wall(position_of_wall_0(), lower);") != std::string::npos);
    CHECK(wgsl::manifest(p).find(wgsl::error_sentences[wgsl::detail::mirror_error - 1]) != std::string::npos);
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("On a sparse grid, mirrored walls act by node, and the blocks of mirror images are entered") {
    auto walls = Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::slip, 0.1});
    walls.at_lower[1].contact = walls.at_upper[1].contact = walls.at_upper[2].contact = Contact::none;
    walls.nodes_behind = NodesBehind::mirrored;
    const auto make = [&]<class Kernel>(const Kernel&, wgsl::GridStorage grid, bool periodic = false) {
        return wgsl::make_program<Kernel, Fmpm, MlsForce, 3>(
            FixedCorotated<float>{}, walls, Gravity<float, 3>{}, FBar{},
            {.grid = grid, .periodic = periodic, .reactions = true}, Fmpm{.order = 2});
    };
    constexpr auto sparse = wgsl::GridStorage::sparse;
    const wgsl::Program dense = make(QuadraticBSpline{}, wgsl::GridStorage::dense),
                        p = make(QuadraticBSpline{}, sparse);
    CHECK(wgsl::step_order_of(dense) == [&] {
        auto order = wgsl::step_order_of(p);
        order.erase(order.begin(), std::find(order.begin(), order.end(), "begin_step"));
        return order;
    }());
    const int table = p.buffer("block_table").binding;
    for (const char* name :
         {"mirror_0", "mirror_1", "term_mirror_0", "term_mirror_1", "fold_rates_0", "fold_rates_1"}) {
        const wgsl::EntryPoint& e = p.entry_point(name);
        CHECK(e.per == "node");
        CHECK(dense.entry_point(name).per == (std::string(name).ends_with('0') ? "x_line" : "z_line"));
        CHECK(std::ranges::any_of(e.bindings, [&](const auto& b) { return b.first == table; }));
    }
    for (const wgsl::EntryPoint& e : p.entry_points) CHECK(e.bindings.size() - 1 <= 8);
    const auto has = [](const wgsl::Program& of, const std::string& part) {
        return of.code.find(part) != std::string::npos;
    };
    CHECK(has(p, "if (at.z == wall_2) {"));
    CHECK(has(p,
              "return vec3<bool>(is_beside(block.x, node_of_wall(position_of_wall_0(), coordinates[4u])) | "
              "is_beside(block.x, node_of_wall(position_of_wall_1(), coordinates[4u])), false, is_beside(block.z, "
              "node_of_wall(position_of_wall_2(), coordinates[params.nodes.x + params.nodes.y + 4u])));"));
    // Of a kernel with wider support, images may be two blocks further.
    CHECK(has(p, "let high = vec3<i32>(1);"));
    CHECK(has(make(CubicBSpline{}, sparse),
              "let high = select(vec3<i32>(1), vec3<i32>(2), are_beside_walls(block + vec3<i32>(2)));"));
    CHECK(has(make(QuadraticBSpline{}, sparse, true), "let further = into_domain(4 * (block + k) - 4) / 4 + 1;"));
    CHECK(!has(dense, "== wall_2"));
    walls.nodes_behind = NodesBehind::held;
    CHECK(!has(make(QuadraticBSpline{}, sparse), "are_beside_walls"));
}
#endif

TEST_CASE("Mirrored walls that lie on no plane of nodes, or too near to each other, are refused with the inputs") {
    Domain<2> domain;
    domain.cell_size = 1.0 / 32;
    Simulation<2> simulation(domain);
    scenes::add_two_blocks<2>(simulation, 0.2, 1.0 / 32);
    const auto refused = [&](const Vec<float, 2>& upper) {
        auto walls = Walls<float, 2>::all({0, 0}, upper, {Contact::slip, 0});
        walls.nodes_behind = NodesBehind::mirrored;
        const wgsl::Program p = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(FixedCorotated<float>{}, walls);
        return message([&] { (void)wgsl::make_inputs<2>(p, domain, simulation.particles(), 1e-4); });
    };
    CHECK(refused({1, 0.9375}).empty());
    CHECK(refused({1, 0.95F}).find("on no plane of nodes") != std::string::npos);
    CHECK(refused({0.0625F, 1}).find("2 cells apart") != std::string::npos);
}

TEST_CASE("A domain too far from 0 for the positions in float is refused with the inputs, with what to move it by") {
    const auto refused = [](double corner) {
        const Domain<2> domain{{corner, 8}, {corner + 1, 9}, 1.0 / 32};
        const auto walls = Walls<float, 2>::all(domain.lower, domain.upper, {Contact::slip, 0});
        Simulation<2> simulation(domain);
        simulation.add(sample_box<2>({corner + 0.25, 8.25}, {corner + 0.5, 8.5}, {.spacing = 1.0 / 32}), 1000);
        const wgsl::Program p = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(FixedCorotated<float>{}, walls);
        return message([&] { (void)wgsl::make_inputs<2>(p, domain, simulation.particles(), 1e-4); });
    };
    CHECK(refused(200).empty());  // the last digit is 1.5e-5 m, a thousandth of a cell 3.1e-5 m
    CHECK(refused(5e5).find("A program for a GPU gets positions up to 500001 m") != std::string::npos);
    CHECK(refused(5e5).find("by minus (500000, 8) m") != std::string::npos);
}

TEST_CASE(
    "An average of volume changes has passes before G2P, which fold it at mirrored walls; other programs have none") {
    auto walls = Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::slip, 0});
    const auto make = [&](const auto& volume) {
        return wgsl::make_program<QuadraticBSpline, Apic, WeightGradientForce, 3>(FixedCorotated<float>{}, walls,
                                                                                  Gravity<float, 3>{}, volume);
    };
    const auto last = [](const wgsl::Program& p, int count, bool sorted = false) {
        const std::vector<std::string> order = wgsl::step_order_of(p, sorted);
        return std::vector<std::string>(order.end() - count, order.end());
    };
    const wgsl::Program own = make(OwnVolume{});
    CHECK(own.code == wgsl::make_program<QuadraticBSpline, Apic, WeightGradientForce, 3>(FixedCorotated<float>{}, walls,
                                                                                         Gravity<float, 3>{})
                          .code);
    for (const std::string& text : {own.code, wgsl::manifest(own)}) {
        CHECK(text.find("average") == std::string::npos);
        CHECK(text.find("rate_sums") == std::string::npos);
    }
    const wgsl::Program held = make(FBar{});
    CHECK(held.name == own.name + "_f_bar");
    CHECK(held.buffer("rate_sums").count == 4);
    for (const bool sorted : {false, true})
        CHECK(last(held, 6, sorted) == std::vector<std::string>{"grid_update", "measure_rates", "choose_rate_scale",
                                                                "scatter_rates", "average_rates", "g2p"});
    walls.nodes_behind = NodesBehind::mirrored;
    const wgsl::Program p = make(FBar{});
    CHECK(last(p, 9) == std::vector<std::string>{"measure_rates", "choose_rate_scale", "scatter_rates", "convert_rates",
                                                 "fold_rates_0", "fold_rates_1", "fold_rates_2", "average_rates",
                                                 "g2p"});
    for (const std::string& name : wgsl::step_order_of(p))
        CHECK(std::any_of(p.entry_points.begin(), p.entry_points.end(), [&](const auto& e) {
            return e.name == name && e.bindings.size() - 1 <= 8 && p.code.find("fn " + name + "(") != std::string::npos;
        }));
    CHECK(wgsl::manifest(p).find("\"volume\": \"f_bar\"") != std::string::npos);
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("A filter of volume ratios has passes before P2G, which average twice; its interval is checked") {
    auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::slip, 0});
    walls.nodes_behind = NodesBehind::mirrored;
    walls.at_lower[0].contact = walls.at_upper[0].contact = Contact::none;
    const auto make = [&](const VolumeFilter& filter) {
        return wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(FixedCorotated<float>{}, walls,
                                                                       Gravity<float, 2>{}, filter);
    };
    const wgsl::Program p = make({.every = 5});
    const std::vector<std::string> average{"choose_rate_scale", "scatter_rates", "convert_rates", "fold_rates_0",
                                           "average_volumes"};
    std::vector<std::string> expected{"begin_step", "clear", "sort", "measure_volumes", "measure_rate_counts"};
    expected.insert(expected.end(), average.begin(), average.end());
    expected.push_back("measure_averages");
    expected.insert(expected.end(), average.begin(), average.end());
    for (const char* name : {"filter_volumes", "measure"}) expected.push_back(name);
    const std::vector<std::string> order = wgsl::step_order_of(p);
    REQUIRE(order.size() > expected.size());
    CHECK(std::equal(expected.begin(), expected.end(), order.begin()));
    for (const std::string& name : order) CHECK(p.has(name));
    for (const wgsl::EntryPoint& e : p.entry_points) CHECK(e.bindings.size() - 1 <= 8);
    CHECK(p.code.find("% 5u != 0u") != std::string::npos);
    CHECK(p.name.ends_with("_volume_filter"));
    CHECK_THROWS_AS(make({.every = 0}), parameter_error);

    // Particles of a material that stores J are shifted, too, unless the rate is 0.
    const auto make_water = [&](const VolumeFilter& filter) {
        return wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(Fluid<float>{}, walls, Gravity<float, 2>{},
                                                                       filter);
    };
    const wgsl::Program water = make_water({});
    const std::vector<std::string> with = wgsl::step_order_of(water);
    const auto after = std::find(with.begin(), with.end(), "filter_volumes") + 1;
    const std::vector<std::string> shifts{"measure_present", "choose_rate_scale", "scatter_rates", "find_excess",
                                          "shift_particles", "sort_shifted",      "measure"};
    REQUIRE(with.end() - after >= std::ptrdiff_t(shifts.size()));
    CHECK(std::equal(shifts.begin(), shifts.end(), after));
    for (const std::string& name : with) CHECK(water.has(name));
    for (const wgsl::EntryPoint& e : water.entry_points) CHECK(e.bindings.size() - 1 <= 8);
    CHECK(water.room_lower == std::vector<double>{-std::numeric_limits<double>::infinity(), 0});
    CHECK(water.room_upper == std::vector<double>{std::numeric_limits<double>::infinity(), 1});
    CHECK_FALSE(make_water({.shifting = 0}).has("shift_particles"));
    CHECK_FALSE(p.has("shift_particles"));
}

TEST_CASE("A transfer that blends velocities has eight numbers for a node; others have nothing of it") {
    auto walls = Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::slip, 0.375});
    const auto make = [&]<class Transfer>(const Transfer& transfer, wgsl::GridStorage grid) {
        return wgsl::make_program<QuadraticBSpline, Transfer, WeightGradientForce, 3>(
            FixedCorotated<float>{}, walls, Gravity<float, 3>{}, OwnVolume{}, {.grid = grid, .sinks = 1}, transfer);
    };
    const auto body_of = [](const wgsl::Program& p, const std::string& name) {
        const std::size_t first = p.code.find("fn " + name + "(");
        return first == std::string::npos ? "" : p.code.substr(first, p.code.find("\n}", first) - first);
    };
    const auto has = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    };
    for (const auto grid : {wgsl::GridStorage::dense, wgsl::GridStorage::sparse}) {
        const wgsl::Program pic = make(Pic{}, grid), p = make(Flip<>{.ratio = 0.75F}, grid);
        for (const std::string& text : {pic.code, wgsl::manifest(pic)}) CHECK_FALSE(has(text, "before_forces"));
        CHECK(pic.buffer("nodes").count == 4);
        CHECK(p.buffer("nodes").count == 8);
        CHECK(p.uniform("transfer_ratio").values == std::vector<double>{0.75});
        CHECK(has(wgsl::manifest(p), "\"momentum_scale_before_forces\": 29"));
        CHECK(has(body_of(p, "blended"), "* params.transfer_ratio"));
        CHECK_FALSE(has(body_of(p, "blended"), "velocity_gradient"));
        CHECK_FALSE(has(body_of(p, "record_before_forces"), "stress"));
        CHECK_FALSE(has(body_of(p, "velocity_before_forces"), "field"));
        CHECK(wgsl::step_order_of(p) == wgsl::step_order_of(pic));
        for (const wgsl::EntryPoint& e : p.entry_points) CHECK(e.bindings.size() - 1 <= 8);
        CHECK(has(body_of(p, "before_forces"),
                  grid == wgsl::GridStorage::sparse ? "64u * params.blocks" : "node_count()"));
        CHECK(has(body_of(p, "scatter"), "node_sums[4u * before_forces(node) + c]"));
        CHECK(has(body_of(p, "scatter_in_arena"), "arena_before[arena_number(node, c)]"));

        const wgsl::Program as = make(Asflip<>{}, grid);
        CHECK(has(body_of(as, "g2p"), "moved_by(v.motion, "));
        CHECK(has(body_of(as, "g2p"), "store_velocity(i, v.velocity)"));
        CHECK(has(body_of(as, "blended"), "select(params.transfer_approach, params.transfer_separation, "));
        CHECK_THROWS_AS(make(Flip<>{.ratio = 1.5F}, grid), parameter_error);
    }
    const wgsl::Program dense = make(Aflip<>{}, wgsl::GridStorage::dense);
    CHECK_NOTHROW(wgsl::check_fits(dense, 1000, {160, 160, 160}));
    CHECK(message([&] { wgsl::check_fits(dense, 1000, {164, 164, 164}); }).find("32 bytes per node") !=
          std::string::npos);

    // Before forces act, mirrored walls are without friction.
    walls.nodes_behind = NodesBehind::mirrored;
    const wgsl::Program p = make(Flip<>{}, wgsl::GridStorage::dense);
    CHECK(has(body_of(p, "mirror_0"), "mirrored_before_0(column_before_0)"));
    CHECK(has(body_of(p, "mirrored_0"), "0.375f * select(pushed"));
    CHECK_FALSE(has(body_of(p, "mirrored_before_0"), "0.375f * select(pushed"));
}

TEST_CASE("A transfer that refines velocities has the entry points of a term as often as there are terms") {
    auto walls = Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::slip, 0.375});
    const auto make = [&]<class Transfer>(const Transfer& transfer, wgsl::GridStorage grid) {
        return wgsl::make_program<QuadraticBSpline, Transfer, WeightGradientForce, 3>(
            FixedCorotated<float>{}, walls, Gravity<float, 3>{}, OwnVolume{},
            {.grid = grid, .sinks = 1, .loads = 1, .reactions = grid == wgsl::GridStorage::dense}, transfer);
    };
    const auto has = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    };
    using Names = std::vector<std::string>;
    for (const auto grid : {wgsl::GridStorage::dense, wgsl::GridStorage::sparse}) {
        const wgsl::Program pic = make(Pic{}, grid), one = make(Fmpm{.order = 1}, grid),
                            p = make(Fmpm{.order = 3}, grid);
        CHECK(wgsl::step_order_of(one) == wgsl::step_order_of(pic));
        CHECK(wgsl::entry_points_of(pic, "refine velocities").empty());
        for (const wgsl::Program& other : {pic, one}) {
            CHECK(other.buffer("nodes").count == 4);
            for (const std::string& text : {other.code, wgsl::manifest(other)}) {
                CHECK_FALSE(has(text, "term"));
                CHECK_FALSE(has(text, "series"));
                CHECK_FALSE(has(text, "before_forces"));
            }
        }
        CHECK(one.uniforms.size() == pic.uniforms.size());
        for (const bool sorted : {false, true}) {
            const std::string scatter = sorted ? "term_blocks" : "scatter_term";
            CHECK(wgsl::entry_points_of(p, "refine velocities", sorted) ==
                  Names{"begin_series", "measure_term", "choose_term_scale", scatter, "next_term", "measure_term",
                        "choose_term_scale", scatter, "last_term"});
            const Names order = wgsl::step_order_of(p, sorted), before = wgsl::step_order_of(pic, sorted);
            const auto begin = std::ranges::find(order, "begin_series");
            REQUIRE(begin != order.begin());
            CHECK(*(begin - 1) == (sorted ? "p2g_blocks" : "p2g"));
            CHECK(order.size() == before.size() + 9);
        }
        CHECK(p.buffer("nodes").count == 12);
        CHECK(p.buffer("term").count == 3);
        CHECK(has(wgsl::manifest(p), "\"momentum_scale_of_term\": 29"));
        CHECK_FALSE(has(wgsl::manifest(p), "momentum_scale_before_forces"));
        for (const wgsl::EntryPoint& e : p.entry_points) {
            INFO(e.name);
            CHECK(e.bindings.size() - 1 <= 8);
        }
        CHECK(p.code == make(Fmpm{.order = 5}, grid).code);  // which is compiled once
        CHECK_THROWS_AS(make(Fmpm{.order = 0}, grid), parameter_error);
        CHECK_FALSE(wgsl::has_own_buffers(p, "next_term"));
        CHECK(wgsl::has_own_buffers(p, "measure_term"));
        CHECK(wgsl::has_own_buffers(p, "scatter_term"));
        CHECK(wgsl::has_own_buffers(p, "term_blocks"));
    }

    // Walls act on each term, without friction.
    walls.nodes_behind = NodesBehind::mirrored;
    const wgsl::Program p = make(Fmpm{.order = 2}, wgsl::GridStorage::dense);
    CHECK(p.buffer("nodes").count == 16);
    CHECK(wgsl::entry_points_of(p, "refine velocities") ==
          Names{"begin_series", "term_mirror_0", "term_mirror_1", "term_mirror_2", "keep_first", "measure_term",
                "choose_term_scale", "scatter_term", "convert_term", "term_mirror_0", "term_mirror_1", "term_mirror_2",
                "last_term"});
    CHECK(has(p.code, "if (has_matter(column_before_0)) { store_column(Line(back_at(line.first)"));
    CHECK_FALSE(has(make(Pic{}, wgsl::GridStorage::dense).code, "mirrored_before_0"));
    CHECK_FALSE(has(make(Fmpm{.order = 1}, wgsl::GridStorage::dense).code, "mirrored_before_0"));
    // This one sums reactions, where another function returns the velocity of a node.
    CHECK(has(p.code, "fn velocity_and_changes("));
    CHECK_FALSE(has(p.code, "velocity_of_node"));
    for (const wgsl::EntryPoint& e : p.entry_points) CHECK(e.bindings.size() - 1 <= 8);

    // Of an affine transfer, particles give their affine field, too.
    struct AffineSeries : Apic {
        int order = 2;
        static Vec<wgsl::recorded, 2> next(const Vec<wgsl::recorded, 2>& v_1, const Vec<wgsl::recorded, 2>& v_j,
                                           const Vec<wgsl::recorded, 2>& there_and_back) {
            return Fmpm::next(v_1, v_j, there_and_back);
        }
    };
    const wgsl::Program affine = wgsl::make_program<QuadraticBSpline, AffineSeries, MlsForce, 2>(
        FixedCorotated<float>{}, NoBoundary{}, Gravity<float, 2>{}, OwnVolume{}, {.grid = wgsl::GridStorage::sparse},
        AffineSeries{});
    CHECK(has(affine.code, "P2GParticle(load_mass(i), load_volume(i), load_term_velocity(i), load_affine_velocity(i)"));
    CHECK(affine.entry_point("term_blocks").bindings.size() - 1 == 8);
}

TEST_CASE("A program for periodic axes has a sparse grid, and the periods as uniforms") {
    const auto make = [](const wgsl::ProgramOptions& options) {
        return wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(FixedCorotated<float>{}, NoBoundary{},
                                                                       Gravity<float, 2>{}, options);
    };
    CHECK_THROWS_AS(make({.periodic = true}), usage_error);
    const wgsl::Program p = make({.grid = wgsl::GridStorage::sparse, .periodic = true});
    Domain<2> ring;
    ring.cell_size = 1.0 / 32;
    ring.periodic = {false, true};
    Particles<float, 2, material_state_t<FixedCorotated<float>, 2>> particles(ring);
    const wgsl::Inputs inputs = wgsl::make_inputs<2>(p, ring, particles, 1e-4);
    const auto value = [&](const char* name) {
        for (std::size_t k = 0; k < p.uniforms.size(); ++k)
            if (p.uniforms[k].name == name) return inputs.uniform(k);
        return std::vector<double>{};
    };
    CHECK(value("period") == std::vector<double>{0, 32});
    CHECK(value("lowest") == std::vector<double>{0, -32});
    CHECK(value("highest") == std::vector<double>{32, 64});
    CHECK_THROWS_AS(wgsl::make_inputs<2>(make({.grid = wgsl::GridStorage::sparse}), ring, particles, 1e-4),
                    parameter_error);
}

TEST_CASE("Programs of several sets count the particles of their own set for averages of volumes") {
    const auto order = [](const auto& material, const auto& volume, bool several) {
        return wgsl::step_order_of(wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(
            material, NoBoundary{}, Gravity<float, 2>{}, volume, {.several_sets = several}));
    };
    const FixedCorotated<float> jelly;
    const auto count = [](const std::vector<std::string>& names, const char* name) {
        return std::ranges::count(names, name);
    };
    CHECK(count(order(jelly, FBar{}, true), "clear_rates") == 1);
    CHECK(count(order(jelly, FBar{}, true), "measure_rate_counts") == 1);
    CHECK(count(order(jelly, FBar{}, false), "clear_rates") == 0);
    CHECK(count(order(jelly, FBar{}, false), "measure_rate_counts") == 0);
    CHECK(count(order(jelly, VolumeFilter{}, true), "clear_rates") == 1);
    CHECK_THROWS_AS(order(Fluid<float>{}, VolumeFilter{}, true), usage_error);
}
#endif

TEST_CASE("Programs of a material that asks have the domain's corner and keep the time; others have nothing of it") {
    const auto make = [](const auto& material, const wgsl::ProgramOptions& options = {}) {
        return wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(
            material, Walls<float, 2>::all({0, 0}, {1, 1}, {}), Gravity<float, 2>{}, VolumeFilter{}, options);
    };
    const auto has = [](const wgsl::Program& p, const char* text) { return p.code.find(text) != std::string::npos; };
    const wgsl::Program asks = make(scenes::Graded<float>{}, {.grid = wgsl::GridStorage::sparse}),
                        not_asks = make(FixedCorotated<float>{}, {.grid = wgsl::GridStorage::sparse}),
                        beside = make(FixedCorotated<float>{}, {.several_sets = true, .keeps_time = true});
    CHECK(asks.keeps_time);
    CHECK(asks.has_uniform("lower_corner"));
    CHECK(has(asks, "fn surroundings_of("));
    for (const char* call : {"updated(load_state(i), taken.velocity_gradient, here)", "kirchhoff_stress(state, here)",
                             "load_volume(i), state, here)", "filtered_volume_of(state, load_volume(i), here)",
                             "status_number(16u), here)", "let reached = time_after(start, chosen.time_step);"})
        CHECK(has(asks, call));
    CHECK(wgsl::manifest(asks).find("\"time_low\": 30") != std::string::npos);
    for (const wgsl::EntryPoint& e : asks.entry_points) {
        INFO(e.name);
        CHECK(e.bindings.size() - 1 <= 8);
    }
    CHECK_FALSE(not_asks.keeps_time);
    CHECK_FALSE(not_asks.has_uniform("lower_corner"));
    for (const char* text : {"here)", "Surroundings", "TimeReached"}) CHECK_FALSE(has(not_asks, text));
    CHECK(wgsl::manifest(not_asks).find("time_low\"") == std::string::npos);
    CHECK(has(not_asks, "bitcast<u32>(status_number(11u) + chosen.time_step)"));
    CHECK(beside.keeps_time);
    CHECK_FALSE(beside.has_uniform("lower_corner"));
    CHECK(has(beside, "fn time_after("));

    const Domain<2> domain{{-3, 2}, {-2, 3}, 1.0 / 16};
    Simulation simulation(domain, scenes::Graded<float>{});
    simulation.add(sample_box<2>({-2.6, 2.4}, {-2.4, 2.6}, {.spacing = 1.0 / 32}), 1000);
    simulation.partition();
    const auto bytes = wgsl::make_inputs<2>(asks, domain, simulation.particles(), 1e-4).uniform_bytes();
    CHECK(float_at(bytes, asks.uniform("lower_corner").offset) == -3.0F);
    CHECK(float_at(bytes, asks.uniform("lower_corner").offset + 4) == 2.0F);
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("A field around a field: damping has the uniforms of both, and is given the velocity") {
    const Damped<float, 2, Attraction> damped{{.gravity = {0, -3}}, 0.5F};
    const wgsl::Program p = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(
        FixedCorotated<float>{}, Walls<float, 2>::all({0, 0}, {1, 1}, {}), damped);
    CHECK(p.field == "damped_attraction");
    CHECK(p.uniform("field_rate").values == std::vector<double>{0.5});
    CHECK(p.uniform("field_field_gravity").values == std::vector<double>{0, -3});
    const std::size_t update = p.code.find("fn velocity_of_node(");
    CHECK(p.code.find("params.field_rate", update) != std::string::npos);
    CHECK(p.code.find("params.field_field_strength", update) != std::string::npos);
}
#endif

TEST_CASE("The pull towards a line falls off to its radius and points at the line; at its centre there is none") {
    const Attraction<double, 3> pull{{0, -10, 0}, {0.5, 0.5, 0.5}, {0, 0, 1}, 0.2, 30};
    const auto near = pull({0.6, 0.5, 0.9});  // half the radius away from the line, whatever z
    CHECK(near[0] == Approx(-15));
    CHECK(near[1] == Approx(-10));
    CHECK(near[2] == Approx(0));
    CHECK(pull({0.5, 0.5, 0.1})[1] == Approx(-10));
    CHECK(pull({0.5, 0.5, 0.1})[0] == Approx(0));
    CHECK(pull({0.9, 0.5, 0.5})[0] == Approx(0));
}
