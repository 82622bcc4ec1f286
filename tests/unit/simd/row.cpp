// release: -O3
/// \file Every form of a row gives the same bits: by itself, and in P2G and G2P of a pack of particles. Rows of
/// integers are rounded as std::llrint rounds.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/loops/gather.hpp>
#include <firn/loops/scatter.hpp>

#include <numeric>

using namespace firn;

namespace {

template <class S>
using bits_of = std::conditional_t<sizeof(S) == 4, std::uint32_t, std::uint64_t>;

template <class S, std::size_t N>
auto bits(const std::array<S, N>& numbers) {
    std::vector<bits_of<S>> r(N);
    std::memcpy(r.data(), numbers.data(), sizeof numbers);
    return r;
}

template <class S>
struct Numbers {
    std::uint64_t next = 1;
    template <std::size_t N>
    std::array<S, N> array() {
        std::array<S, N> r;
        for (S& x : r) x = S(4 * scenes::noise(next++) - 2);
        return r;
    }
};

/// The K nodes of a row, one after the other.
template <class Row, class S, int K = Row::nodes>
std::array<S, std::size_t(4 * K)> nodes_of(const Row& row) {
    std::array<S, std::size_t(4 * K)> r{};
    unroll<K>([&](auto k) { row.template node<k>().store(r.data() + 4 * k); });
    return r;
}

template <class S, int K>
struct Shape {
    using scalar = S;
    static constexpr int nodes = K;
};

}  // namespace

TEMPLATE_TEST_CASE("A row in wide registers has the bits of a node a register", "", (Shape<float, 2>),
                   (Shape<float, 3>), (Shape<float, 4>), (Shape<double, 2>), (Shape<double, 3>), (Shape<double, 4>)) {
    using S = typename TestType::scalar;
    constexpr int K = TestType::nodes;
    Numbers<S> random;
    for (int trial = 0; trial < 20; ++trial) {
        const auto a = random.template array<17>(), b = random.template array<17>();
        auto quad_of = random.template array<5>(), weights = random.template array<5>();
        for (int k = K; k < 5; ++k) weights[std::size_t(k)] = 0;
        const auto results = [&]<class Row>(std::type_identity<Row>) {
            std::vector<bits_of<S>> r;
            const auto put = [&](const Row& row) {
                const auto of_row = bits(nodes_of<Row, S>(row));
                r.insert(r.end(), of_row.begin(), of_row.end());
            };
            // From odd places: nothing is aligned.
            const Row x = Row::load(a.data() + 1), y = Row::load(b.data() + 1);
            put(x);
            put(Row::repeat(quad_of.data() + 1));
            put(Row::spread(weights.data()));
            put(x + y);
            put(x - y);
            put(x * y);
            put(x * Row::Number::fill(&a[0]));
            put(plus_times(x, y, Row::repeat(quad_of.data() + 1)));
            put(plus_times(x, y, Row::Number::fill(&a[0])));
            put(times_minus(x, Row::Number::fill(&a[0]), y));
            return r;
        };
        const auto expected = results(std::type_identity<portable_row<S, K>>{});
        CHECK(results(std::type_identity<row<S, K>>{}) == expected);
        CHECK(results(std::type_identity<exact_row<S, K>>{}) == expected);

        // What the functions are, on the portable form.
        using Row = portable_row<S, K>;
        const auto loaded = nodes_of<Row, S>(Row::load(a.data() + 1));
        const auto repeated = nodes_of<Row, S>(Row::repeat(quad_of.data() + 1));
        const auto spread = nodes_of<Row, S>(Row::spread(weights.data()));
        for (std::size_t i = 0; i < std::size_t(4 * K); ++i) {
            CHECK(loaded[i] == a[i + 1]);
            CHECK(repeated[i] == quad_of[1 + i % 4]);
            CHECK(spread[i] == weights[i / 4]);
        }
    }
}

TEMPLATE_TEST_CASE("The nodes of a row may lie in two places", "", (Shape<float, 2>), (Shape<float, 3>),
                   (Shape<float, 4>), (Shape<double, 3>)) {
    using S = typename TestType::scalar;
    constexpr int K = TestType::nodes;
    Numbers<S> random;
    for (int split = 1; split <= 4; ++split) {
        const std::size_t in_first = std::size_t(std::min(split, K)), in_second = std::size_t(K) - in_first;
        // Memory of exactly the nodes: a sanitizer sees what portable rows read beyond.
        const auto numbers = random.template array<16>();
        const std::vector<S> first(numbers.begin(), numbers.begin() + 4 * in_first),
            second(numbers.begin() + 4 * in_first, numbers.begin() + 4 * K);
        const S* const from = in_second > 0 ? second.data() - 4 * in_first : first.data();
        const auto check = [&]<class Row>(std::type_identity<Row>) {
            const auto read = nodes_of<Row, S>(Row::of_runs(first.data(), from, split));
            for (std::size_t i = 0; i < std::size_t(4 * K); ++i) CHECK(read[i] == numbers[i]);
        };
        check(std::type_identity<row_of_runs<S, K>>{});
        check(std::type_identity<portable_row<S, K>>{});
    }
}

TEMPLATE_TEST_CASE("Storing a row that was read changes nothing; an exact one touches its nodes alone", "",
                   (Shape<float, 2>), (Shape<float, 3>), (Shape<float, 4>), (Shape<double, 3>)) {
    using S = typename TestType::scalar;
    constexpr int K = TestType::nodes;
    Numbers<S> random;
    const auto before = random.template array<20>();
    auto after = before;
    row<S, K>::load(after.data() + 4).store(after.data() + 4);
    CHECK(bits(after) == bits(before));

    const auto written = random.template array<16>();
    exact_row<S, K>::load(written.data()).store(after.data() + 4);
    for (std::size_t i = 0; i < after.size(); ++i)
        CHECK(after[i] == (i >= 4 && i < 4 + std::size_t(4 * K) ? written[i - 4] : before[i]));
}

namespace {

/// A pack of particles at random places in a block, two to a cell now and then.
template <class Kernel, class S, int D>
struct Pack {
    Vec<S, D> position[pack_size];

    explicit Pack(Numbers<S>& random) {
        for (int l = 0; l < pack_size; ++l)
            for (int a = 0; a < D; ++a)
                position[l][a] = l % 3 == 1 ? position[l - 1][a] : 2 + S(1.4) * random.template array<1>()[0];
    }
    template <class P>
    Vec<P, D> lanes(std::size_t slot) const {
        Vec<P, D> r{};
        for (int a = 0; a < D; ++a)
            for (int l = 0; l < scalar_traits<P>::lanes; ++l) r.v[a].set(l, position[slot + std::size_t(l)][a]);
        return r;
    }
};

/// Particles for PackRecords: records of random numbers.
template <class Kernel, class S, int D>
struct RandomRecords : Pack<Kernel, S, D> {
    P2GRecord<S, D> records[pack_size];

    explicit RandomRecords(Numbers<S>& random) : Pack<Kernel, S, D>(random) {
        for (auto& record : records) {
            record.mass = random.template array<1>()[0];
            for (int i = 0; i < D; ++i) record.momentum[i] = random.template array<1>()[0];
            for (int i = 0; i < D * D; ++i) {
                record.affine.m[i] = random.template array<1>()[0];
                record.gradient.m[i] = random.template array<1>()[0];
            }
        }
    }
    template <class P>
    Vec<P, D> position(std::size_t slot) const {
        return this->template lanes<P>(slot);
    }
    std::size_t slots(std::size_t slot) const { return slot; }
    template <class, class P>
    Vec<P, D> block_in_arena(std::size_t, int) const {
        return Vec<P, D>::zero();
    }
    template <class, class, class, class P>
    P2GRecord<P, D> record(std::size_t slot, const Vec<P, D>&) const {
        P2GRecord<P, D> r{};
        for (int l = 0; l < scalar_traits<P>::lanes; ++l) {
            const auto& of_lane = records[slot + std::size_t(l)];
            r.mass.set(l, of_lane.mass);
            for (int i = 0; i < D; ++i) r.momentum.v[i].set(l, of_lane.momentum[i]);
            for (int i = 0; i < D * D; ++i) {
                r.affine.m[i].set(l, of_lane.affine.m[i]);
                r.gradient.m[i].set(l, of_lane.gradient.m[i]);
            }
        }
        return r;
    }
};

template <class Sums, class Kernel, class S, int D, class Form>
struct RowsInForm {
    using Row = Form;
    typename Sums::number* first;
    auto load(int line) const {
        return Sums::template load<Row>(first + line_begin<Kernel, D>(line, arena_size<Kernel>) * node_width);
    }
    template <class Sum, class... Weighted>
    static Sum plus(const Sum& sum, const Weighted&... row) {
        return Sums::plus(sum, row...);
    }
    template <class Sum>
    void store(int line, const Sum& sum) const {
        Sums::store(first + line_begin<Kernel, D>(line, arena_size<Kernel>) * node_width, sum);
    }
};

template <class S_, int D_, class Force_, class Kernel_ = QuadraticBSpline>
struct Case {
    using S = S_;
    static constexpr int D = D_;
    using Force = Force_;
    using Kernel = Kernel_;
};

// Every pair of scalar, dimension, force and kernel that is allowed.
#define FIRN_PAIRWISE_CASES                                                                                            \
    (Case<float, 3, MlsForce>), (Case<double, 2, WeightGradientForce>), (Case<float, 3, WeightGradientForce, Linear>), \
        (Case<double, 2, WeightGradientForce, Linear>), (Case<float, 3, WeightGradientForce, CubicBSpline>),           \
        (Case<float, 2, MlsForce, CubicBSpline>), (Case<double, 3, MlsForce, CubicBSpline>)
#if defined(FIRN_TEST_ALL)
#define FIRN_ROW_CASES \
    FIRN_PAIRWISE_CASES, (Case<float, 3, WeightGradientForce>), (Case<float, 2, MlsForce>), (Case<double, 3, MlsForce>)
#else
#define FIRN_ROW_CASES FIRN_PAIRWISE_CASES
#endif

}  // namespace

TEMPLATE_TEST_CASE("P2G and G2P of a pack have the same bits in every form of rows", "", FIRN_ROW_CASES) {
    using S = typename TestType::S;
    using Force = typename TestType::Force;
    using Kernel = typename TestType::Kernel;
    constexpr int D = TestType::D, K = Kernel::support;
    using Sums = FloatSums<S>;
    constexpr int n = arena_size<Kernel>;
    constexpr std::size_t count = std::size_t(((D == 2 ? 1 : n) * n * n + 4) * node_width);
    Numbers<S> random;
    for (int trial = 0; trial < 10; ++trial) {
        const RandomRecords<Kernel, S, D> particles(random);
        PackRecords<Kernel, Force, S, D> records;
        records.template fill<Apic>(particles, particles, 0, n, Sums{});
        std::vector<int> at_corner(count), told;
        records.count(0, pack_size, [&](std::ptrdiff_t corner, int more) { at_corner[std::size_t(corner)] += more; });
        REQUIRE(std::accumulate(at_corner.begin(), at_corner.end(), 0) == pack_size);
        const auto tell = [&](std::ptrdiff_t corner, int more) { told[std::size_t(corner)] += more; };
        const auto scattered = [&]<class Row, bool held>(std::type_identity<Row>, std::bool_constant<held>) {
            std::array<S, count> arena{};
            const auto rows_at = [&](std::ptrdiff_t corner) {
                return RowsInForm<Sums, Kernel, S, D, Row>{arena.data() + corner};
            };
            told.assign(count, 0);
            records.template scatter<held>(0, pack_size, rows_at, tell);
            CHECK(told == at_corner);
            return bits(arena);
        };
        using Portable = std::type_identity<portable_row<S, K>>;
        using Wide = std::type_identity<row<S, K>>;
        const auto expected = scattered(Portable{}, std::false_type{});
        CHECK(scattered(Portable{}, std::true_type{}) == expected);
        CHECK(scattered(Wide{}, std::false_type{}) == expected);
        CHECK(scattered(Wide{}, std::true_type{}) == expected);

        const IntegerSums<std::int32_t, S> quanta(FixedPointScale<S>{0x1p24, 0x1p22});
        records.template fill<Apic>(particles, particles, 0, n, quanta);
        const auto counted = [&]<class Row, bool held>(std::type_identity<Row>, std::bool_constant<held>) {
            std::vector<std::int32_t> arena(count);
            const auto rows_at = [&](std::ptrdiff_t corner) {
                return RowsInForm<IntegerSums<std::int32_t, S>, Kernel, S, D, Row>{arena.data() + corner};
            };
            told.assign(count, 0);
            records.template scatter<held>(0, pack_size, rows_at, tell);
            CHECK(told == at_corner);
            return arena;
        };
        const auto integers = counted(Portable{}, std::true_type{});
        CHECK(counted(Wide{}, std::false_type{}) == integers);
        CHECK(counted(Wide{}, std::true_type{}) == integers);

        const auto nodes = random.template array<count>();
        PackPlaces<Kernel, g2p_needs_gradient<Kernel, Apic, Force>, S, D> pack;
        TransferSums<Kernel, Apic, Force, S, D> sums;
        using P = native_pack<S>;
        for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes)
            pack.locate(lane, particles.template position<P>(std::size_t(lane)), Vec<P, D>::zero(), n);
        const auto gathered = [&]<class Row>(std::type_identity<Row>) {
            sums.gather(pack.weights, [&](int l, auto line) {
                return Row::load(nodes.data() + pack.weights.corner[l] + line_begin<Kernel, D>(line, n) * node_width);
            });
            std::array<S, std::size_t(decltype(sums)::quads * pack_size * 4)> r;
            std::memcpy(r.data(), sums.value, sizeof r);
            return bits(r);
        };
        CHECK(gathered(Wide{}) == gathered(Portable{}));
    }
}

TEST_CASE("Floats are rounded to the nearest integers, ties to even, in every form of rows and as std::llrint does") {
    std::vector<float> numbers{0.0f,       -0.0f,         0.5f,           -0.5f,        1.5f,        -1.5f,
                               2.5f,       -2.5f,         0.49999997f,    -0.49999997f, 8388607.5f,  -8388607.5f,
                               8388606.5f, 4194303.75f,   8388608.0f,     -8388609.0f,  16777215.0f, 1e9f,
                               -1e9f,      2147483520.0f, -2147483648.0f, 1e-40f};
    for (std::uint64_t i = 0; numbers.size() < 20'000; ++i) {
        const double size = std::exp2(32 * scenes::noise(3 * i) - 1);
        const float x = float(size * (2 * scenes::noise(3 * i + 1) - 1));
        numbers.push_back(i % 2 ? x : std::floor(x) + 0.5f);  // every other one a tie, where x is small enough
    }
    numbers.resize(numbers.size() / 16 * 16);
    const auto check = [&]<class Row, class Integer>(std::type_identity<Row>, Integer) {
        constexpr std::size_t count = std::size_t(4 * Row::nodes);
        for (std::size_t i = 0; i + 16 <= numbers.size(); i += count) {
            Integer rounded[16] = {};
            nearest<Integer>(Row::load(&numbers[i])).store(rounded);
            for (std::size_t k = 0; k < count; ++k)
                if (rounded[k] != Integer(std::llrint(numbers[i + k]))) {
                    CAPTURE(numbers[i + k], rounded[k]);
                    FAIL_CHECK("is not rounded as std::llrint does");
                }
        }
    };
    check(std::type_identity<row<float, 2>>{}, std::int32_t{});
    check(std::type_identity<row<float, 3>>{}, std::int32_t{});
    check(std::type_identity<row<float, 4>>{}, std::int32_t{});
    check(std::type_identity<portable_row<float, 3>>{}, std::int32_t{});
    check(std::type_identity<row<float, 3>>{}, std::int64_t{});
    for (std::size_t i = 0; i + 16 <= numbers.size(); i += 4) {
        const auto rounded = detail::portable_nearest(quad<float>::load(&numbers[i]));
        for (int k = 0; k < 4; ++k) CHECK(rounded.v[k] == std::int32_t(std::llrint(numbers[i + std::size_t(k)])));
    }
}
