// The recording scalar against the definitions themselves: a small interpreter evaluates the recorded graph in float,
// operation by operation, and must give the bits that the definition gives when it is evaluated with float.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/boundary/distance_grid.hpp>
#include <firn/core/lanes.hpp>
#include <firn/data/sampled_distance.hpp>
#include <firn/field/attraction.hpp>
#include <firn/wgsl/module.hpp>
#include <firn/wgsl/stage_shapes.hpp>

#include "../examples/eigen_material.hpp"
#include "../examples/own_material.hpp"

using namespace firn;
using wgsl::Op;
using wgsl::recorded;
using wgsl::Recording;

namespace {

/// Evaluates a graph. Inputs are named "0", "1", …
class Interpreter {
public:
    Interpreter(const wgsl::Graph& graph, const std::vector<float>& inputs, const std::vector<float>& distances = {})
        : graph_(graph),
          inputs_(inputs),
          distances_(distances),
          value_(graph.nodes.size()),
          loop_(graph.loops.size()) {}

    float operator()(int output) {
        for (int i = 0; i < int(graph_.nodes.size()); ++i)
            if (graph_.region[std::size_t(i)] == wgsl::nothing) evaluate(i);
        return value_[std::size_t(output)];
    }

private:
    void evaluate(int i) {
        const wgsl::Node& n = graph_.nodes[std::size_t(i)];
        const auto at = [&](int k) { return value_[std::size_t(k)]; };
        const auto set = [&](auto x) { value_[std::size_t(i)] = float(x); };
        switch (n.op) {
            case Op::constant:
            case Op::truth:
                return set(n.value);
            case Op::input:
                return set(inputs_.at(std::size_t(std::stoi(n.text))));
            case Op::add:
                return set(at(n.a) + at(n.b));
            case Op::subtract:
                return set(at(n.a) - at(n.b));
            case Op::multiply:
                return set(at(n.a) * at(n.b));
            case Op::divide:
                return set(at(n.a) / at(n.b));
            case Op::negate:
                return set(-at(n.a));
            case Op::less:
                return set(at(n.a) < at(n.b));
            case Op::less_equal:
                return set(at(n.a) <= at(n.b));
            case Op::equal:
                return set(at(n.a) == at(n.b));
            case Op::both:
                return set(at(n.a) != 0 && at(n.b) != 0);
            case Op::either:
                return set(at(n.a) != 0 || at(n.b) != 0);
            case Op::inverse:
                return set(at(n.a) == 0);
            case Op::select:
                return set(at(n.a) != 0 ? at(n.b) : at(n.c));
            case Op::square_root:
                return set(std::sqrt(at(n.a)));
            case Op::magnitude:
                return set(std::abs(at(n.a)));
            case Op::round_down:
                return set(std::floor(at(n.a)));
            case Op::settled:
                return set(at(n.a));
            case Op::round_to_even:
                return set(std::nearbyint(at(n.a)));
            case Op::power_of_two:
                return set(firn::power_of_two(at(n.a)));
            case Op::exponent_of:
                return set(firn::exponent_of(at(n.a)));
            case Op::significand_of:
                return set(firn::significand_of(at(n.a)));
            case Op::leading_half:
                return set(firn::leading_half(at(n.a)));
            case Op::index_after:
                return set(at(n.a) + at(n.b) * at(n.c));
            case Op::distance_at:
                return set(distances_.at(std::size_t(at(n.a))));
            case Op::loop:
                return run(n.a);
            case Op::call:
            case Op::call_result:
                throw usage_error("The interpreter knows no functions.");
            case Op::loop_value:
            case Op::loop_result:
                return set(loop_[std::size_t(n.a)][std::size_t(n.b)]);
        }
    }
    void run(int number) {
        const wgsl::Loop& loop = graph_.loops[std::size_t(number)];
        std::vector<float>& now = loop_[std::size_t(number)];
        now.clear();
        for (const int k : loop.initial) now.push_back(value_[std::size_t(k)]);
        for (int pass = 0; pass < loop.passes; ++pass) {
            for (int i = 0; i < int(graph_.nodes.size()); ++i)
                if (graph_.region[std::size_t(i)] == number) evaluate(i);
            for (std::size_t k = 0; k < now.size(); ++k) now[k] = value_[std::size_t(loop.next[k])];
            if (loop.go_on != wgsl::nothing && value_[std::size_t(loop.go_on)] == 0) break;
        }
    }

    const wgsl::Graph& graph_;
    const std::vector<float>&inputs_, distances_;
    std::vector<float> value_;
    std::vector<std::vector<float>> loop_;
};

template <class T>
T inputs() {
    T value{};
    int number = 0;
    wgsl::for_components(value,
                         [&](recorded& x) { x = recorded::of(Recording::current().input(std::to_string(number++))); });
    return value;
}

/// How many numbers of the result differ in their bits, over many matrices: mild, inverted, nearly singular, zero.
template <int D, class Lanes = float, class Definition>
int differences(const Definition& definition, const auto& domain) {
    Recording recording;
    Mat<recorded, D> result = definition(inputs<Mat<recorded, D>>());
    int different = 0;
    for (std::uint64_t trial = 0; trial < 400; ++trial) {
        Mat<float, D> F = Mat<float, D>::zero();
        const double strain = trial % 4 == 0 ? 3 : trial % 4 == 1 ? 0.1 : 1;
        for (int k = 0; k < D * D; ++k)
            F.m[k] = float((k % (D + 1) == 0) + strain * (scenes::noise(trial * 9 + std::uint64_t(k)) - 0.5));
        if (trial % 50 == 7)
            for (int i = 0; i < D; ++i) F(i, 0) = 1e-4F * F(i, 1);
        if (trial == 99) F = Mat<float, D>::zero();
        if (!domain(F)) continue;
        const Mat<Lanes, D> of_lanes = definition(cast<Lanes>(F));
        Mat<float, D> expected;
        for (int k = 0; k < D * D; ++k) expected.m[k] = lane_value(of_lanes.m[k], 0);
        const std::vector<float> numbers(F.m, F.m + D * D);
        for (int k = 0; k < D * D; ++k) {
            const float got = Interpreter(recording.graph, numbers)(result.m[k].node);
            // ±0 may differ: what adds zero is left out.
            different += !(got == expected.m[k] || (std::isnan(got) && std::isnan(expected.m[k])));
        }
    }
    return different;
}

template <int D>
int differences(const auto& definition) {
    return differences<D>(definition, [](const auto&) { return true; });
}

/// The stress of a material whose parameters are constants of the graph.
template <template <class> class Material>
struct Stress {
    template <class S, int D>
    Mat<S, D> operator()(const Mat<S, D>& F) const {
        Material<S> model;
        model.mu = S(4e4F);
        model.lambda = S(6e4F);
        return firn::kirchhoff_stress(model, ElasticState<S, D>{F});
    }
};

/// A shape around a grid of distances that has no normal itself.
template <scalar S, int D>
struct Thicker {
    DistanceGrid<S, D> grid;
    static constexpr auto parameters() { return std::tuple{parameter{"grid", "", &Thicker::grid}}; }
    S signed_distance(const Vec<S, D>& x) const { return grid.signed_distance(x) - S(0.01F); }
};

/// How many distances and normals of a grid differ, which begins somewhere in a buffer, at points in it and around it.
template <int D>
int differences_of_grids() {
    const auto f = [](const Vec<double, D>& x) { return norm(x) - 0.3 + 0.05 * std::sin(9 * x[0]); };
    Vec<double, D> upper = Vec<double, D>::filled(0.4);
    upper[0] = 0.25, upper[D - 1] = 0.5;
    const DistanceGrid<float, D> grid{
        sampled_distance<D>(f, {.lower = Vec<double, D>::filled(-0.35), .upper = upper, .spacing = 0.07}),
        Vec<double, D>::filled(0.05)};
    std::vector<float> buffer(7, std::nanf("")), numbers(std::size_t{D});
    buffer.insert(buffer.end(), grid.numbers->values.begin(), grid.numbers->values.end());
    const auto told = grid.told_to_program(7);
    for_parameters(told, [&](const std::string&, const char*, const auto& value) {
        for (const double x : firn::detail::as_doubles(value)) numbers.push_back(float(x));
    });

    Recording recording;
    const auto x = inputs<Vec<recorded, D>>();
    auto of_program = lift<recorded>(Thicker<float, D>{grid});
    int number = D;
    for_parameters(of_program, [&](const std::string&, const char*, auto& value) {
        wgsl::for_components(
            value, [&](recorded& one) { one = recorded::of(Recording::current().input(std::to_string(number++))); });
    });
    const auto results = [](const auto& thicker, const auto& at) {
        std::vector all{thicker.grid.signed_distance(at)};
        for (const auto& normal : {normal_of(thicker.grid, at), normal_of(thicker, at)})
            all.insert(all.end(), normal.v, normal.v + D);
        return all;
    };
    const auto recorded_ones = results(of_program, x);
    int different = number == int(numbers.size()) ? 0 : 1;
    for (std::uint64_t trial = 0; trial < 500; ++trial) {
        Vec<float, D> at{};
        for (int a = 0; a < D; ++a)
            at[a] = numbers[std::size_t(a)] = float(1.4 * scenes::noise(trial * D + std::uint64_t(a)) - 0.7);
        const auto expected = results(Thicker<float, D>{grid}, at);
        for (std::size_t k = 0; k < expected.size(); ++k)
            different += Interpreter(recording.graph, numbers, buffer)(recorded_ones[k].node) != expected[k];
    }
    return different;
}

int count(const std::string& text, const std::string& part) {
    int n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
}

}  // namespace

static_assert(scalar<recorded>);

TEST_CASE("A recorded definition computes the bits that the definition computes") {
    CHECK(differences<2>(Stress<FixedCorotated>{}) == 0);
    CHECK(differences<3>(Stress<FixedCorotated>{}) == 0);
    CHECK(differences<2>(Stress<SoftTissue>{}) == 0);
    CHECK(differences<3>(Stress<SoftTissue>{}) == 0);
    // Of one float Eigen computes several components at once, and adds up in another order. Where J is not positive the
    // stress is NaN, off the diagonal as a product with the 0 of I, which is left out while recording.
    const auto upright = [](const auto& F) { return determinant(F) > 0; };
    CHECK(differences<2, native_pack<float>>(Stress<EigenNeoHookean>{}, upright) == 0);
    CHECK(differences<3, native_pack<float>>(Stress<EigenNeoHookean>{}, upright) == 0);
}

TEST_CASE("A grid of distances is read from a buffer with the bits that the shape has, also by dual numbers") {
    CHECK(differences_of_grids<2>() == 0);
    CHECK(differences_of_grids<3>() == 0);
    Recording recording;
    const auto input = [&](const char* text) { return recorded::of(recording.graph.input(text)); };
    const recorded cell = index_after(input("first"), input("i"), input("stride"));
    const int next = index_after(cell, recorded(1), recorded(1)).node;
    CHECK(count(wgsl::Body(recording.graph, {next}).statements(), " = first + u32(i) * stride + 1u;") == 1);
}

TEST_CASE("A module has the look-up in a grid of distances once, and calls it once for each place") {
    using V = Vec<recorded, 2>;
    using Grid = DistanceGrid<recorded, 2>;
    using InProgram = decltype(Grid::grid);
    wgsl::Module module;
    module.function<InProgram, InProgram, V, recorded>(
        "f", "a test", {"one", "other", "x", "cap"},
        [](const InProgram& one, const InProgram& other, const V& x, const recorded& cap) {
            const Grid first{nullptr, {}, one}, second{nullptr, {}, other};
            const recorded d = first.signed_distance(x);
            recorded far = cap;
            const auto near = d < cap;
            if (any(near)) far = select(near, first.normal(x)[1] + second.signed_distance(x * cap), cap);
            return far + first.signed_distance(x) + Thicker<recorded, 2>{first}.signed_distance(x);
        });
    const std::string text = module.text();
    CAPTURE(text);
    CHECK(count(text, "fn found_in_grid(grid: GridOfDistances, x: vec2<f32>) -> FoundInGrid {") == 1);
    CHECK(count(text, " = found_in_grid(") == 2);
    CHECK(count(text, "struct GridOfDistances {") == 1);
    CHECK(count(text, "distances[") == 4);
    CHECK(text.find("fn found_in_grid") < text.find("fn f("));
    CHECK(count(text,
                "GridOfDistances(one.lower, one.nodes, one.spacing, one.per_spacing, one.strides, one.first), "
                "vec2<f32>(x.x, x.y)") == 1);
    // What only a branch needs is called there.
    CHECK(text.find("found_in_grid(GridOfDistances(other.lower") > text.find("if ("));
    CHECK(count(text, "        let t") >= 1);
}

TEST_CASE("A function that others call has one definition, is recorded by itself, and may call one") {
    const auto square = [](const recorded& x) { return x * x; };
    const auto fourth = [&](const recorded& x) {
        return record_call("square", "a test", {"x"}, square, record_call("square", "a test", {"x"}, square, x));
    };
    wgsl::Module module;
    module.function<recorded, recorded>("f", "a test", {"x", "y"}, [&](const recorded& x, const recorded& y) {
        const recorded sum = record_call("fourth", "a test", {"x"}, fourth, x + y);
        return repeat<3>(sum, [&](const recorded& z) { return record_call("square", "a test", {"x"}, square, z * y); });
    });
    const std::string text = module.text();
    CAPTURE(text);
    CHECK(count(text, "fn square(x: f32) -> f32 {\n    let t1 = x * x;\n    return t1;\n}") == 1);
    CHECK(count(text,
                "fn fourth(x: f32) -> f32 {\n    let t1 = square(x);\n    let t2 = square(t1);\n    return t2;") == 1);
    CHECK(count(text, "    let t1 = fourth(x + y);\n") == 1);
    CHECK(count(text, "        let t2 = square(loop0_0 * y);\n") == 1);
    const auto other = [](const recorded& x) { return x; };
    const auto add = [&](const auto& definition) {
        module.function<recorded>("g", "a test", {"x"}, [&](const recorded& x) {
            return record_call("square", "a test", {"x"}, definition, x);
        });
    };
    CHECK_NOTHROW(add(square));
    CHECK_THROWS_AS(add(other), usage_error);
    CHECK_THROWS_AS(module.function<>("h", "a test", {},
                                      [&] { return record_call("square", "a test", {"x"}, square, recorded()); }),
                    usage_error);
    CHECK(wgsl::Module::recording() == nullptr);
    CHECK_NOTHROW(Recording());
}

TEST_CASE("A deformation gradient is recorded as F - I, also where a definition sets a number of F") {
    const auto definition = []<class S, int D>(const Mat<S, D>& F) {
        auto moved = increased(DeformationGradient<S, D>(F), F * S(1e-3F));
        moved(0, 0) = moved(0, 1) + S(0.75F);
        return displacement_gradient(moved);
    };
    CHECK(differences<2>(definition) == 0);
    CHECK(differences<3>(definition) == 0);

    Recording recording;
    using Gradient = DeformationGradient<recorded, 3>;
    Gradient F = increased(inputs<Gradient>(), Mat<recorded, 3>::diagonal(recorded(0.5F)));
    std::vector<int> outputs;
    wgsl::for_components(F, [&](recorded& x) { outputs.push_back(x.node); });
    const std::size_t nodes = recording.graph.nodes.size();
    std::size_t next = 0;
    const std::string text = wgsl::shape<Gradient>::build(F, [&](const recorded& x) {
        CHECK(x.node == outputs[next++]);  // F − I, without an operation of its own
        return std::string("x");
    });
    CHECK(text.find("mat3x3<f32>(") == 0);
    CHECK(recording.graph.nodes.size() == nodes);
}

TEST_CASE("What occurs twice is recorded once, in either order; what nothing needs is not written") {
    wgsl::Module module;
    module.function<recorded, recorded>("f", "a test", {"x", "y"}, [](const recorded& x, const recorded& y) {
        const recorded product = x * y, same = y * x;
        const recorded unused = sqrt(product) / y;
        (void)unused;
        return product + recorded(1) / same;
    });
    CHECK(count(module.text(), "x * y") == 1);
    CHECK(count(module.text(), "y * x") == 0);
    CHECK(count(module.text(), "sqrt") == 0);
}

TEST_CASE("Constants are computed while recording, in float") {
    Recording recording;
    const recorded third = recorded(1) / recorded(3);
    REQUIRE(recording.graph.nodes[std::size_t(third.node)].op == Op::constant);
    CHECK(recording.graph.nodes[std::size_t(third.node)].value == 1.0F / 3.0F);
    const recorded x = recorded::of(recording.graph.input("x"));
    CHECK((x * recorded(1)).node == x.node);
    CHECK((x + recorded(0)).node == x.node);
    CHECK(select(recorded(1) < recorded(2), x, third).node == x.node);
    CHECK(!any(recorded(2) < recorded(1)));
    CHECK(any(x < third));
}

TEST_CASE("Sums and products of which GPU compilers join constants are written so that they cannot") {
    // spirv-opt, for one, makes x + 5 of the first; the CPU rounds twice.
    const auto text_of = [](const auto& of) {
        wgsl::Module module;
        module.function<recorded>("f", "a test", {"x"}, of);
        return module.text();
    };
    const auto has = [](const std::string& text, const char* what) { return text.find(what) != std::string::npos; };
    CHECK(has(text_of([](const recorded& x) { return (recorded(3) + x) + recorded(2); }),
              "max(3.0f + x, -3e+38f) + 2.0f"));
    CHECK(has(text_of([](const recorded& x) { return recorded(2) - (x - recorded(3)); }),
              "2.0f - max(x - 3.0f, -3e+38f)"));
    CHECK(has(text_of([](const recorded& x) { return (x * recorded(0.1)) * recorded(3); }),
              "max(x * 0.1f, -3e+38f) * 3.0f"));
    CHECK(!has(text_of([](const recorded& x) { return (x + recorded(3)) * recorded(2); }), "max"));
}

TEST_CASE("Masks are combined without a branch") {
    wgsl::Module module;
    module.function<recorded, recorded>("f", "a test", {"x", "y"}, [](const recorded& x, const recorded& y) {
        const auto low = x < recorded(1), lower = y < x, same = x == y;
        return select((low & lower) | !same, x, y);
    });
    CHECK(count(module.text(), "((x < 1.0f) & (y < x)) | !(x == y)") == 1);
    CHECK(count(module.text(), "&&") + count(module.text(), "||") == 0);
}

TEST_CASE("Loops stay loops, and what only rare lanes need is computed in a branch") {
    wgsl::Module module;
    module.function<Mat<recorded, 3>>("V", "left_stretch", {"F"},
                                      [](const Mat<recorded, 3>& F) { return left_stretch(F); });
    // Halley's iteration and the Jacobi sweeps; the sweeps stop early, and only run where the mask holds.
    CHECK(count(module.text(), "for (var") == 2);
    CHECK(count(module.text(), "break;") == 1);
    CHECK(count(module.text(), "if (t") + count(module.text(), "if (!") >= 2);
    const std::size_t branch = module.text().find("if (t"), sweeps = module.text().rfind("for (var");
    CHECK(branch < sweeps);
    CHECK(count(module.text(), "let J = ") == 1);  // the definition's own name
}

TEST_CASE("A loop in a loop belongs to it where it depends on it") {
    // x → x/2 + 1/(x + k), the 1/… twice within each pass, from the outer pass's x.
    const auto definition = [](const auto& x) {
        using S = std::remove_cvref_t<decltype(x)>;
        return repeat<3>(x, [&](const S& outer) {
            const S inner = repeat<2>(outer * S(0.5), [&](const S& y) { return y + S(1) / (outer + y * x); });
            return inner - outer * S(0.25);
        });
    };
    Recording recording;
    const recorded result = definition(recorded::of(recording.graph.input("0")));
    REQUIRE(recording.graph.loops.size() == 2);
    CHECK(recording.graph.loops[1].parent == 0);
    const std::vector<int> output{result.node};
    const std::string text = wgsl::Body(recording.graph, output).statements();
    CHECK(text.find("for (var pass1") > text.find("for (var pass0"));
    for (const float x : {0.5F, 2.0F, -3.0F}) {
        const std::vector<float> numbers{x};
        CHECK(Interpreter(recording.graph, numbers)(result.node) == definition(x));
    }
}

TEST_CASE("A branch in a branch belongs to it where nothing else needs its results") {
    const auto text_of = [](bool used_outside) {
        Recording recording;
        const recorded x = recorded::of(recording.graph.input("x")), y = recorded::of(recording.graph.input("y"));
        recorded outer = x, inner = y;
        const auto large = recorded(2) < x, larger = recorded(3) < y;
        if (any(large)) {
            const recorded root = sqrt(x);
            if (any(larger)) inner = select(larger, floor(root), root);
            outer = select(large, inner * root, x);
        }
        const std::vector<int> output{used_outside ? (outer + inner).node : outer.node};
        return wgsl::Body(recording.graph, output).statements();
    };
    const std::string nested = text_of(false), apart = text_of(true);
    CAPTURE(nested, apart);
    CHECK(count(nested, "\n    if (") == 1);
    CHECK(count(nested, "\n        if (") == 1);
    const std::size_t branch = nested.find("    if ("), inside = nested.rfind("if (");
    CHECK(nested.find("sqrt") > branch);
    CHECK(nested.find("sqrt") < inside);
    CHECK(nested.find("floor") > inside);
    CHECK(count(nested, "floor") == 1);
    CHECK(count(apart, "\n    if (") == 2);
    CHECK(count(apart, "\n        if (") == 0);
    CHECK(apart.find("sqrt") < apart.find("if ("));
}

TEST_CASE("A number is written so that it reads back as the same float; infinity and NaN are no constants") {
    for (std::uint32_t i = 0; i < 20000; ++i) {
        const float x = std::bit_cast<float>(i * 214'013u + 2'531'011u);
        if (!std::isfinite(x)) continue;
        const std::string text = wgsl::literal(x);
        REQUIRE(text.back() == 'f');
        REQUIRE(text.find_first_of(".e") != std::string::npos);
        REQUIRE(std::strtof(text.c_str(), nullptr) == x);
    }
    CHECK(wgsl::literal(std::numeric_limits<float>::infinity()) == "from_bits(2139095040u)");
}

TEST_CASE("Recording at the wrong time, or reading what has no value, is told") {
    CHECK_THROWS_AS(recorded(1), usage_error);
    Recording recording;
    CHECK_THROWS_AS(Recording(), usage_error);
    CHECK_THROWS_AS(recorded() + recorded(1), usage_error);
    CHECK_NOTHROW(recorded(1));
}
