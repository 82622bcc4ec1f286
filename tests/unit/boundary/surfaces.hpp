/// \file Shapes with what is known of them without a distance: which points are inside, which lie on the surface.
#pragma once

#include "support/random_numbers.hpp"
#include <firn/boundary/shapes.hpp>

#include <algorithm>
#include <cmath>

namespace surfaces {

using firn::Vec;
using test_support::Random;

template <int D>
struct Ball {
    using Shape = firn::Sphere<double, D>;
    static constexpr double r = 0.35;
    static Shape shape() { return {r}; }
    static bool is_inside(const Vec<double, D>& x) { return firn::dot(x, x) < r * r; }
    static Vec<double, D> point(Random& random) { return random.direction<D>() * r; }
};

template <int D>
struct Cuboid {
    using Shape = firn::Box<double, D>;
    static Vec<double, D> half() {
        Vec<double, D> h = Vec<double, D>::filled(0.2);
        h[0] = 0.45;
        return h;
    }
    static Shape shape() { return {half()}; }
    static bool is_inside(const Vec<double, D>& x) {
        for (int a = 0; a < D; ++a)
            if (std::abs(x[a]) >= half()[a]) return false;
        return true;
    }
    static Vec<double, D> point(Random& random) {
        Vec<double, D> x{};
        for (int a = 0; a < D; ++a) x[a] = random.uniform(-half()[a], half()[a]);
        const int face = int(random.uniform(0, D));
        x[face] = random.uniform(0, 1) < 0.5 ? -half()[face] : half()[face];
        return x;
    }
};

/// A cylinder (in the plane: a rectangle) and two balls.
template <int D>
struct Rounded {
    using Shape = firn::Capsule<double, D>;
    static constexpr double l = 0.3, r = 0.15;
    static Shape shape() { return {l, r}; }
    static bool is_inside(Vec<double, D> x) {
        const double along = x[1];
        x[1] = 0;
        const double from_axis = firn::norm(x);
        return (std::abs(along) <= l && from_axis < r) || std::hypot(from_axis, along - l) < r ||
               std::hypot(from_axis, along + l) < r;
    }
    static Vec<double, D> point(Random& random) {
        Vec<double, D> x = random.direction<D>() * r;
        const double end = random.uniform(0, 1) < 0.5 ? -l : l;
        if (random.uniform(0, 1) < 0.5) {
            x[1] = end + std::copysign(x[1], end);
        } else {
            x[1] = 0;
            x = x * (r / firn::norm(x));
            x[1] = random.uniform(-l, l);
        }
        return x;
    }
};

template <int D>
struct Slope {
    using Shape = firn::HalfSpace<double, D>;
    static Vec<double, D> outward() {
        Vec<double, D> n = Vec<double, D>::zero();
        n[0] = -0.6;
        n[1] = 0.8;
        return n;
    }
    static Shape shape() { return {outward()}; }
    static bool is_inside(const Vec<double, D>& x) { return 0.8 * x[1] < 0.6 * x[0]; }
    static Vec<double, D> point(Random& random) {
        Vec<double, D> x = random.vector<D>(-2, 2);
        x[1] = 0.75 * x[0];
        return x;
    }
};

template <class Of>
struct Hollow {
    using Shape = firn::Complement<typename Of::Shape>;
    static constexpr int D = firn::shape_facts<Shape>::dimension;
    static Shape shape() { return {Of::shape()}; }
    static bool is_inside(const Vec<double, D>& x) { return !Of::is_inside(x); }
    static Vec<double, D> point(Random& random) { return Of::point(random); }
};

/// A stranger's: a ring, in the plane of the first two axes, by nothing but its distance.
template <firn::scalar S, int D>
struct Ring {
    S large = S(0.3), small = S(0.1);
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"large", "m", &Ring::large}, firn::parameter{"small", "m", &Ring::small}};
    }
    S signed_distance(const Vec<S, D>& x) const {
        using firn::sqrt, firn::abs;
        const S from_circle = sqrt(x[0] * x[0] + x[1] * x[1]) - large;
        if constexpr (D == 2)
            return abs(from_circle) - small;
        else
            return sqrt(from_circle * from_circle + x[2] * x[2]) - small;
    }
};

template <int D>
struct Torus {
    using Shape = Ring<double, D>;
    static constexpr double R = 0.3, r = 0.1;
    static Shape shape() { return {R, r}; }
    static bool is_inside(const Vec<double, D>& x) {
        const double from_axis = std::hypot(x[0], x[1]);
        return std::hypot(from_axis - R, D == 3 ? x[D - 1] : 0.0) < r;
    }
    static Vec<double, D> point(Random& random) {
        const double turn = random.uniform(0, 2 * std::numbers::pi), round = random.uniform(0, 2 * std::numbers::pi);
        const double out = D == 3 ? R + r * std::cos(round) : round < std::numbers::pi ? R - r : R + r;
        Vec<double, D> x{};
        x[0] = out * std::cos(turn);
        x[1] = out * std::sin(turn);
        if (D == 3) x[D - 1] = r * std::sin(round);
        return x;
    }
};

}  // namespace surfaces
