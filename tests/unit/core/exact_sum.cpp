/// \file Exact sums: against integers that are wide enough for all doubles, and the same bits in any order and any
/// parts.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/exact_sum.hpp>

#include <bitset>
#include <numeric>

using firn::ExactSum;

namespace exact_sum_tests {

using limits = std::numeric_limits<double>;
constexpr double infinity = limits::infinity(), least = limits::denorm_min(), largest = limits::max();

/// A number of the smallest subnormal double as two's complement, bit by bit. Bit k is worth 2^(k − 1074).
class WideInteger {
public:
    static constexpr std::size_t width = 2300;

    void add(double x) {
        int exponent = 0;
        const auto significand = std::uint64_t(std::ldexp(std::frexp(std::abs(x), &exponent), 53));
        if (significand == 0) return;
        // |x| = significand · 2^(exponent − 53)
        const int place = exponent - 53 + 1074;
        std::bitset<width> more(place < 0 ? significand >> -place : significand);
        if (place > 0) more <<= std::size_t(place);
        add(x < 0 ? minus(more) : more);
    }
    double rounded() const {
        const bool is_negative = bits_[width - 1];
        const std::bitset<width> magnitude = is_negative ? minus(bits_) : bits_;
        int top = int(width) - 1;
        while (top >= 0 && !magnitude[std::size_t(top)]) --top;
        const int last = std::max(top - 52, 0);
        std::uint64_t kept = 0;
        for (int k = top; k >= last; --k) kept = 2 * kept + magnitude[std::size_t(k)];
        if (last > 0 && magnitude[std::size_t(last - 1)]) {
            bool is_more_than_half = false;
            for (int k = 0; k < last - 1; ++k) is_more_than_half = is_more_than_half || magnitude[std::size_t(k)];
            kept += is_more_than_half || kept % 2 == 1;
        }
        const double result = std::ldexp(double(kept), last - 1074);
        return is_negative ? -result : result;
    }

private:
    static std::bitset<width> minus(std::bitset<width> a) {
        a.flip();
        for (std::size_t k = 0; k < width; ++k) {
            a.flip(k);
            if (a[k]) break;  // no carry
        }
        return a;
    }
    void add(std::bitset<width> more) {
        while (more.any()) {
            const auto carry = (bits_ & more) << 1;
            bits_ ^= more;
            more = carry;
        }
    }
    std::bitset<width> bits_;
};

double by_definition(const std::vector<double>& numbers) {
    WideInteger sum;
    for (const double x : numbers) sum.add(x);
    return sum.rounded();
}
double one_by_one(const std::vector<double>& numbers) {
    ExactSum sum;
    for (const double x : numbers) sum.add(x);
    return sum.value();
}
double at_once(const std::vector<double>& numbers) {
    ExactSum sum;
    sum.add(numbers);
    return sum.value();
}
/// Whether the two have the same bits. For sums, NaN equals itself, and 0 does not equal −0.
bool same(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

/// Random numbers whose exponents lie in a window of `spread`.
std::vector<double> random_numbers(std::mt19937_64& engine, std::size_t count, std::uint64_t lowest,
                                   std::uint64_t spread) {
    std::vector<double> numbers(count);
    for (double& x : numbers) {
        const std::uint64_t exponent = lowest + engine() % spread;
        x = std::bit_cast<double>((engine() & 0x800fffffffffffff) | exponent << 52);
    }
    return numbers;
}

void check(const std::vector<double>& numbers, double expected) {
    CAPTURE(numbers.size(), expected, one_by_one(numbers), at_once(numbers));
    REQUIRE(same(one_by_one(numbers), expected));
    REQUIRE(same(at_once(numbers), expected));
}

TEST_CASE("an exact sum is the one of Python's fractions, rounded once") {
    check({-0x1.5eb5621636369p-532, -0x1.a02f3795b929ep-532, -0x1.035ef9b08923dp-536}, -0x1.878d44a37bf95p-531);
    check({-0x1.8d00342650644p+841, 0x1.b7970fee29476p+839, 0x1.8cb4ad6225675p+842}, 0x1.fa4eea9984bc4p+841);
    check({0x1.268ecdc6bf1e1p-8, 0x1.de38326d0b944p-8, -0x1.bdc2a63d2e490p-15, 0x1.10645c6f8da3ep-6,
           0x1.97524f51e8722p+0, 0x1.07f06c7b317d9p-29, -0x1.7906144f9794cp+7, -0x1.e0f9eeb8f624fp-2},
          -0x1.76b966ee6674ep+7);
    check({-0x1.6d4b9ebcd1f5ep-180, 0x1.93b05cd085b71p-184, 0x1.e0fd62257989fp-171, 0x1.22ced092fdddfp-224,
           0x1.f729b420b0ebep-217, -0x1.a06c0c76abf43p-203, -0x1.81daa6bd0638bp-211, -0x1.59d5492f3277bp-206},
          0x1.e05359d734848p-171);
    check({-0x1.3b7da95918694p+487, -0x1.ea6d5ae966193p+414, -0x1.47997db3d1150p+99, -0x1.b2109abd8952cp+690,
           0x1.8ab12f6f22f41p+404, -0x1.1aa4b91b1078ep+655, -0x1.a20ab360c4979p+741, -0x1.48f2f445fad2ap+657},
          -0x1.a20ab360c497cp+741);
    check({-0x1.09382ff9e4840p-538, 0x1.1badb13b45a39p-1007, -0x1.f2ead08085f68p+75, 0x1.4aa71686e80a9p+968,
           -0x1.b092527fca832p-482, 0x1.56fe0de26c45bp+985, 0x1.23695f56ab44ep-284, -0x1.6072c60b6cbb1p+743},
          0x1.56feb335f7892p+985);
}

TEST_CASE("an exact sum is the one of wide integers, in any order, added one by one, many at once or in parts") {
    std::mt19937_64 engine(5);
    const auto [count, lowest, spread] =
        GENERATE(table<std::size_t, std::uint64_t, std::uint64_t>({{1, 0, 2046},
                                                                   {7, 1000, 3},
                                                                   {64, 0, 40},
                                                                   {255, 2000, 46},
                                                                   {256, 1000, 90},
                                                                   {257, 0, 2046},
                                                                   {600, 1000, 1},
                                                                   {600, 990, 200},
                                                                   {600, 100, 100},
                                                                   {600, 2015, 20},
                                                                   {1300, 0, 700},
                                                                   {1300, 1346, 700},
                                                                   {3000, 900, 60},
                                                                   {3000, 1023, 120}}));
    CAPTURE(count, lowest, spread);
    std::vector<double> numbers = random_numbers(engine, count, lowest, spread);
    const double expected = by_definition(numbers);
    check(numbers, expected);
    for (int order = 0; order < 3; ++order) {
        std::shuffle(numbers.begin(), numbers.end(), engine);
        check(numbers, expected);
        for (const std::size_t parts : {2, 3, 7}) {
            ExactSum sum;
            std::vector<ExactSum> of_parts(parts);
            for (std::size_t p = 0; p < parts; ++p) {
                const std::size_t first = count * p / parts, last = count * (p + 1) / parts;
                const auto part = std::span<const double>(numbers).subspan(first, last - first);
                if (p % 2 == 0)
                    of_parts[p].add(part);
                else
                    for (const double x : part) of_parts[p].add(x);
                sum += of_parts[p];
            }
            REQUIRE(same(sum.value(), expected));
            // As ranks do: normalised, then integer by integer.
            for (ExactSum& part : of_parts) part.normalise();
            for (std::size_t p = 1; p < parts; ++p)
                for (std::size_t k = 0; k < ExactSum::size; ++k) of_parts[0].digits()[k] += of_parts[p].digits()[k];
            REQUIRE(same(of_parts[0].value(), expected));
        }
    }
    // What is added with the other sign takes all of it back.
    std::vector<double> both = numbers;
    for (const double x : numbers) both.push_back(-x);
    std::shuffle(both.begin(), both.end(), engine);
    check(both, 0.0);
}

TEST_CASE("an exact sum rounds to nearest, and ties to even, from subnormals to infinity") {
    // Around 1: half of the last digit is 2^−53.
    check({1, 0x1p-53}, 1);
    check({1, 0x1p-53, least}, 1 + limits::epsilon());
    check({1, 0x1p-53, -least}, 1);
    check({1 + limits::epsilon(), 0x1p-53}, 1 + 2 * limits::epsilon());
    check({1 + limits::epsilon(), 0x1p-53, -least}, 1 + limits::epsilon());
    check({-1, -0x1p-53, -least}, -1 - limits::epsilon());
    check({2 - limits::epsilon(), 0x1p-53}, 2);
    // Cancellation leaves what was far below.
    check({1e308, 1, 1e-300, -1, -1e308}, 1e-300);
    check({0x1p1000, 0x1p-1000, -0x1p1000}, 0x1p-1000);
    check({0x1p60, 1.5, -0x1p60}, 1.5);
    // Subnormals are exact.
    check({least, least, least}, 3 * least);
    check({limits::min(), -least}, limits::min() - least);
    check({limits::min(), -limits::min(), -least}, -least);
    check(std::vector<double>(1000, least), 1000 * least);
    // More than the largest double, and back.
    check({largest, largest, -largest}, largest);
    check({1e308, 1e308, 1e308, -1e308, -1e308}, 1e308);
    check({-largest, -largest}, -infinity);
    check(std::vector<double>(1000, largest), infinity);
    check({largest, 0x1p969}, largest);  // less than half of the last digit, which is 2^971
    check({largest, 0x1p970}, infinity);
    check({largest, 0x1p970, -least}, largest);
    // Zeros.
    check({}, 0.0);
    check({-0.0, -0.0}, 0.0);
    check({1, -1}, 0.0);
    check(std::vector<double>(300, 0.0), 0.0);
}

TEST_CASE("exact sums of NaN and infinities know no order either") {
    const double nan = limits::quiet_NaN();
    std::mt19937_64 engine(7);
    const auto in_all_places = [&](std::vector<double> numbers, double expected) {
        numbers.resize(300, 1.5);
        for (int order = 0; order < 5; ++order) {
            check(numbers, expected);
            ExactSum first, second;
            first.add(std::span<const double>(numbers).first(100));
            second.add(std::span<const double>(numbers).subspan(100));
            second += first;
            CHECK(same(second.value(), expected));
            std::shuffle(numbers.begin(), numbers.end(), engine);
        }
    };
    in_all_places({infinity}, infinity);
    in_all_places({-infinity, -infinity, largest}, -infinity);
    in_all_places({infinity, -infinity}, nan);
    in_all_places({nan}, nan);
    in_all_places({-nan, infinity, -largest}, nan);
    check(std::vector<double>(300, nan), nan);
    check(std::vector<double>(300, -infinity), -infinity);
    // However many they are, normalised sums may be added.
    ExactSum many;
    for (int k = 0; k < 3; ++k) many.add(infinity);
    for (int k = 0; k < 100; ++k) (many += many).normalise();
    CHECK(same(many.value(), infinity));
}

TEST_CASE("an exact sum carries in time, however much is added") {
    const double x = std::bit_cast<double>(std::uint64_t(1) << 52 | 0xfffffffffffff);  // all bits set, place 0
    ExactSum twice;
    twice.add(x);
    for (int k = 0; k < 1000; ++k) twice += twice;
    CHECK(same(twice.value(), std::ldexp(x, 1000)));

    for (const double sign : {1, -1}) {
        // 2³¹ − 2 additions are open when the last ones are made one by one.
        ExactSum power, sum;
        power.add(sign * x);
        for (int k = 1; k < 31; ++k) {
            power += power;
            sum += power;
        }
        for (int k = 0; k < 6; ++k) sum.add(sign * x);
        sum += power;
        WideInteger expected;  // (2³¹ + 4 + 2³⁰) x
        for (const double times : {0x1p31, 4.0, 0x1p30}) expected.add(sign * times * x);
        CHECK(same(sum.value(), expected.rounded()));
    }
}

TEST_CASE("the digits of several sums lie one after another") {
    std::vector<ExactSum> sums(3);
    for (std::size_t k = 0; k < 3; ++k) sums[k].add(double(k + 1));
    for (ExactSum& sum : sums) sum.normalise();
    const auto digits = firn::digits_of(sums);
    REQUIRE(digits.size() == 3 * ExactSum::size);
    std::vector<std::int64_t> other(digits.begin(), digits.end());
    for (std::size_t k = 0; k < digits.size(); ++k) digits[k] += other[k];
    for (std::size_t k = 0; k < 3; ++k) CHECK(sums[k].value() == 2 * double(k + 1));
}

}  // namespace exact_sum_tests
