/// \file One test body for every scalar: a definition evaluated with S must give what it gives for plain double.
///
/// A definition is written as `Out f(const S* in)` for any S, its results collected in `Numbers<S>`. Each lane gets
/// inputs of its own, so that mixed-up lanes are seen; a dual number's derivative is compared with a difference
/// quotient of the double evaluation.
#pragma once

#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/dual.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/strict.hpp>
#include <firn/core/tensor.hpp>

#include <limits>
#include <vector>

/// Every scalar there is (the recorder of a GPU program apart). In the plain test command without double, which is what
/// the others are compared with, and with one strict one, which is there to be compiled.
#if defined(FIRN_TEST_ALL)
#define FIRN_EVERY_SCALAR                                                                                        \
    float, double, firn::native_pack<float>, firn::native_pack<double>, firn::dual<double>, firn::strict<float>, \
        firn::strict<double>
#else
#define FIRN_EVERY_SCALAR \
    float, firn::native_pack<float>, firn::native_pack<double>, firn::dual<double>, firn::strict<float>
#endif

namespace test_support {

/// What a definition gives, flattened.
template <class S>
struct Numbers {
    std::vector<S> all;

    Numbers& add(const S& a) {
        all.push_back(a);
        return *this;
    }
    template <int D>
    Numbers& add(const firn::Vec<S, D>& a) {
        all.insert(all.end(), a.v, a.v + D);
        return *this;
    }
    template <int D>
    Numbers& add(const firn::Mat<S, D>& a) {
        all.insert(all.end(), a.m, a.m + D * D);
        return *this;
    }
    template <std::size_t N>
    Numbers& add(const std::array<S, N>& a) {
        all.insert(all.end(), a.begin(), a.end());
        return *this;
    }
};

/// What a definition takes, read in order.
template <class S>
struct Reader {
    const S* next;

    S scalar() { return *next++; }
    template <int D>
    firn::Vec<S, D> vector() {
        firn::Vec<S, D> r{};
        for (int i = 0; i < D; ++i) r[i] = *next++;
        return r;
    }
    template <int D>
    firn::Mat<S, D> matrix() {
        firn::Mat<S, D> r{};
        for (int i = 0; i < D * D; ++i) r.m[i] = *next++;
        return r;
    }
};

template <std::floating_point T>
void set_lane(T& s, int, double value) {
    s = T(value);
}
template <std::floating_point T>
void set_lane(firn::strict<T>& s, int, double value) {
    s.value = T(value);
}
template <class T, int N>
void set_lane(firn::pack<T, N>& s, int lane, double value) {
    s.set(lane, T(value));
}
template <class T>
void set_lane(firn::dual<T>& s, int, double value) {
    s = {T(value), T(0)};
}

template <std::floating_point T>
double lane_of(const T& s, int) {
    return double(s);
}
template <std::floating_point T>
double lane_of(const firn::strict<T>& s, int) {
    return double(s.value);
}
template <class T, int N>
double lane_of(const firn::pack<T, N>& s, int lane) {
    return double(s[lane]);
}
template <class T>
double lane_of(const firn::dual<T>& s, int) {
    return double(s.value);
}

/// \param cases      inputs of one evaluation each
/// \param magnitude  magnitude(in): the size of the terms that a result is summed from; an error is counted in ε of it
/// \param epsilons   rounding errors allowed
template <class S, class Definition, class Magnitude>
void same_as_double(const Definition& definition, std::vector<std::vector<double>> cases, const Magnitude& magnitude,
                    double epsilons) {
    using T = firn::value_type_t<S>;
    constexpr int lanes = firn::scalar_traits<S>::lanes;
    constexpr double epsilon = double(std::numeric_limits<T>::epsilon());
    for (auto& in : cases)
        for (double& x : in) x = double(float(x));  // the same input for every scalar

    double worst = 0;
    for (std::size_t first = 0; first < cases.size(); ++first) {
        const auto of_lane = [&](int lane) -> const std::vector<double>& {
            return cases[(first + std::size_t(lane)) % cases.size()];
        };
        std::vector<S> in(of_lane(0).size(), S(0));
        for (int lane = 0; lane < lanes; ++lane)
            for (std::size_t k = 0; k < in.size(); ++k) set_lane(in[k], lane, of_lane(lane)[k]);
        if constexpr (std::same_as<S, firn::dual<double>>)
            for (std::size_t k = 0; k < in.size(); ++k) in[k].derivative = in[k].value * (k % 3 == 1 ? -0.5 : 1.0);
        const Numbers<S> out = definition(in.data());
        REQUIRE(!out.all.empty());

        for (int lane = 0; lane < lanes; ++lane) {
            const auto& plain_in = of_lane(lane);
            const Numbers<double> plain = definition(plain_in.data());
            REQUIRE(out.all.size() == plain.all.size());
            for (std::size_t k = 0; k < plain.all.size(); ++k) {
                const double error = std::abs(lane_of(out.all[k], lane) - plain.all[k]) / magnitude(plain_in.data());
                if (!(error <= epsilons * epsilon)) {
                    CAPTURE(first, lane, k, lane_of(out.all[k], lane), plain.all[k]);
                    CHECK(error / epsilon <= epsilons);
                    return;
                }
                worst = std::max(worst, error / epsilon);
            }
        }

        if constexpr (std::same_as<S, firn::dual<double>>) {
            constexpr double step = 1e-6;
            std::vector<double> ahead, behind;
            for (const S& x : in) {
                ahead.push_back(x.value + step * x.derivative);
                behind.push_back(x.value - step * x.derivative);
            }
            const Numbers<double> after = definition(ahead.data()), before = definition(behind.data());
            for (std::size_t k = 0; k < after.all.size(); ++k) {
                const double quotient = (after.all[k] - before.all[k]) / (2 * step);
                CAPTURE(first, k);
                CHECK(std::abs(out.all[k].derivative - quotient) <= 1e-7 * magnitude(of_lane(0).data()));
            }
        }
    }
    UNSCOPED_INFO("largest error: " << worst << " epsilon of " << epsilons);
}

}  // namespace test_support
