/// \file The page's scenes of point masses: balls, bodies in 2D, a cloth, a pile of soft bodies, and a fountain.
#pragma once

#include "support/solids.hpp"
#include <firn/data/sampling.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/rope.hpp>
#include <firn/lagrangian/soft_body.hpp>

#include "system_scene.hpp"

#include <numbers>

namespace live {

inline constexpr double pi = std::numbers::pi;

/// Random numbers from −1 to 1.
class Noise {
public:
    explicit Noise(std::uint64_t seed) : random_(seed) {}
    double operator()() { return 2 * firn::unit_interval(random_.bits()) - 1; }

private:
    firn::RandomSequence random_;
};

/// Foam balls of different sizes fall into a box.
class Balls final : public SystemScene<2> {
public:
    Balls(std::size_t particles, int threads)
        : Balls(checked_number("balls", particles, 1000, 1, 10'000), threads, 0) {}

private:
    Balls(std::size_t count, int threads, int)
        : SystemScene({.dimension = 2, .target = {1, 0.62, 0}, .lower = {0, 0, 0}, .upper = {2, 1.25, 0}},
                      count > 4000 ? 8 : 4, threads) {
        constexpr double density = 30, filled = 0.42;  // [kg/m²]; part of the box
        const double radius = std::sqrt(filled * 2 * 1.25 / (double(count) * 1.09 * pi)), spacing = 2.15 * 1.3 * radius;
        const auto columns = std::size_t(std::max(1.0, std::floor(2 / spacing)));
        Noise noise(5);
        for (std::size_t i = 0; i < count; ++i) {
            const double r = radius * (1 + 0.3 * noise()), column = double(i % columns), row = double(i / columns);
            system_.points.add({.position = {(column + 0.5) * 2 / double(columns) + 0.1 * radius * noise(),
                                             0.02 + (row + 0.5) * spacing},
                                .velocity = {0.3 * noise(), 0.0},
                                .mass = density * pi * r * r,
                                .radius = r});
        }
        system_.collisions.emplace();
        add_drag();
    }
    bool is_ball(std::size_t) const override { return true; }
    float kind_of(std::size_t i) const override { return float(system_.points.id[i] % 6); }
};

/// Two ropes, soft discs and boxes, and two ragdolls, in 2D.
class Bodies final : public SystemScene<2> {
public:
    Bodies(std::size_t, int threads)
        : SystemScene({.dimension = 2, .target = {1.2, 0.72, 0}, .lower = {0, 0, 0}, .upper = {2.4, 1.5, 0}}, 8,
                      threads) {
        system_.collisions.emplace();
        system_.damping = 0.15;
        reach = 0.05;
        add_drag();
        bridge();
        wrecking_ball();
        for (int i = 0; i < 3; ++i) disc({0.35 + 0.33 * i, 1.15 + 0.12 * i}, 0.13 - 0.015 * i);
        box({1.5, 0.25}, {0.4, 0.2});
        box({1.55, 0.6}, {0.24, 0.24});
        ragdoll({0.55, 0.15});
        ragdoll({1.45, 1.0});
    }

private:
    using P = firn::Vec<double, 2>;
    static constexpr double density = 60;  // [kg/m²]

    std::uint32_t next_group() { return ++groups_; }
    static float kind(std::uint32_t group) { return float((group + 1) % 7); }

    std::size_t rope(const P& a, const P& b, std::size_t segments, double radius) {
        const firn::Net<2> net = firn::rope(a, b, segments);
        const std::uint32_t group = next_group();
        const std::size_t first = system_.add(net, {.mass = 0.12, .radius = radius, .group = group});
        firn::ConstraintsOfKinds stiffness{};
        stiffness[std::size_t(firn::LinkKind::bend)].compliance = 1e-3;
        system_.constraints.add(net, stiffness, first);
        for (std::uint32_t i = 0; i < segments; ++i)
            rods_.push_back({{std::uint32_t(first + i), std::uint32_t(first + i + 1)}, float(radius), 6});
        return first;
    }
    void bridge() {
        constexpr std::size_t segments = 40;
        const std::size_t first = rope({0.0, 0.8}, {1.05, 0.85}, segments, 0.014);
        add_pin(std::uint32_t(first));
        add_pin(std::uint32_t(first + segments));
    }
    void wrecking_ball() {
        constexpr std::size_t segments = 22;
        const P top{1.95, 1.42}, bottom{2.28, 0.95};
        const std::size_t first = rope(top, bottom, segments, 0.01);
        add_pin(std::uint32_t(first));
        const double radius = 0.1;
        const P along = (bottom - top) * (1 / norm(bottom - top));
        const std::uint32_t ball = system_.points.add({.position = bottom + along * radius,
                                                       .mass = 4 * density * pi * radius * radius,
                                                       .radius = radius,
                                                       .group = groups_});
        const auto last = std::uint32_t(first + segments);
        system_.constraints.add({last, ball}, radius);
        rods_.push_back({{last, ball}, 0.01F, 6});
    }
    /// A wheel: a ring of points, spokes to the hub, and links across the ring.
    void disc(const P& middle, double radius) {
        constexpr std::uint32_t ring = 20;
        const std::uint32_t group = next_group();
        const double point = 1.15 * pi * radius / ring;
        const auto first = std::uint32_t(system_.points.size());
        const auto at = [&](std::uint32_t i) { return first + i % ring; };
        const double mass = density * pi * radius * radius / (ring + 1);
        for (std::uint32_t i = 0; i <= ring; ++i) {
            const double angle = 2 * pi * i / ring, r = i < ring ? radius - point : 0;
            system_.points.add({.position = middle + P{r * std::cos(angle), r * std::sin(angle)},
                                .mass = mass,
                                .radius = i < ring ? point : 0,
                                .group = group});
        }
        const auto link = [&](std::uint32_t a, std::uint32_t b, double compliance, firn::LinkKind as) {
            const auto apart = system_.points.position[b] - system_.points.position[a];
            system_.constraints.add({a, b}, norm(apart), {.compliance = compliance}, as);
        };
        std::vector<std::array<std::uint32_t, 3>> fan;
        for (std::uint32_t i = 0; i < ring; ++i) {
            link(at(i), at(i + 1), 0, firn::LinkKind::stretch);
            link(at(i), at(i + 2), 2e-4, firn::LinkKind::bend);
            link(at(i), first + ring, 3e-4, firn::LinkKind::support);
            if (i < ring / 2) link(at(i), at(i + ring / 2), 2e-4, firn::LinkKind::support);
            fan.push_back({at(i), at(i + 1), first + ring});
            rods_.push_back({{at(i), at(i + 1)}, float(point), kind(group)});
        }
        add_triangles(fan, 0);
    }
    void box(const P& middle, const P& size) {
        constexpr double cell = 0.04;
        const P half = size * 0.5;
        const auto samples = firn::sample_box<2>(middle - half, middle + half * (1 + 1e-9), {.spacing = cell});
        const auto body = firn::lattice_body(samples);
        const std::uint32_t group = next_group();
        const double radius = 0.55 * cell;
        const std::size_t first =
            system_.add(body.net, {.masses = body.masses(density), .radius = radius, .group = group});
        system_.constraints.add(body.net, firn::ConstraintOptions{.compliance = 1e-4}, first);
        std::set<std::uint32_t> surface;
        for (const auto& facet : body.net.facets) surface.insert(facet.begin(), facet.end());
        for (std::uint32_t i = 0; i < body.net.positions.size(); ++i)
            if (!surface.contains(i)) inner_.insert(std::uint32_t(first + i));
        for (const auto& [a, b] : body.net.facets)
            rods_.push_back({{std::uint32_t(first + a), std::uint32_t(first + b)}, float(radius), kind(group)});
        std::vector<std::array<std::uint32_t, 3>> halves;
        const auto corner = [&](const P& x) {
            const auto& all = body.net.positions;
            return std::uint32_t(std::min_element(all.begin(), all.end(),
                                                  [&](const P& a, const P& b) { return norm(a - x) < norm(b - x); }) -
                                 all.begin());
        };
        for (const P& x : samples.positions) {
            const double h = cell / 2;
            const std::uint32_t a = corner(x + P{-h, -h}), b = corner(x + P{h, -h}), c = corner(x + P{h, h}),
                                d = corner(x + P{-h, h});
            halves.push_back({a, b, c});
            halves.push_back({a, c, d});
        }
        add_triangles(halves, first);
    }
    /// A ragdoll of straight bones, whose joints are points that bones share.
    void ragdoll(const P& feet) {
        enum Joint {
            head,
            neck,
            shoulder_l,
            shoulder_r,
            hip_l,
            hip_r,
            elbow_l,
            elbow_r,
            hand_l,
            hand_r,
            knee_l,
            knee_r,
            foot_l,
            foot_r,
            joints
        };
        constexpr double x[joints] = {0,    0,     -0.055, 0.055,  -0.04, 0.04,  -0.11,
                                      0.11, -0.17, 0.17,   -0.055, 0.055, -0.06, 0.06};
        constexpr double y[joints] = {0.475, 0.385, 0.36, 0.36, 0.2, 0.2, 0.27, 0.27, 0.2, 0.2, 0.1, 0.1, 0, 0};
        const std::uint32_t group = next_group();
        const auto first = std::uint32_t(system_.points.size());
        for (int j = 0; j < joints; ++j)
            system_.points.add({.position = feet + P{x[j], y[j]},
                                .mass = j == head ? 0.6 : 0.35,
                                .radius = j == head ? 0.058 : 0.024,
                                .group = group});
        const auto bone = [&](std::uint32_t a, std::uint32_t b, bool is_drawn = true, double compliance = 0) {
            const P from{x[a], y[a]}, to{x[b], y[b]};
            system_.constraints.add({first + a, first + b}, norm(to - from), {.compliance = compliance},
                                    firn::LinkKind::support);
            if (is_drawn) rods_.push_back({{first + a, first + b}, 0.024F, kind(group)});
        };
        bone(neck, shoulder_l), bone(neck, shoulder_r), bone(shoulder_l, shoulder_r), bone(hip_l, hip_r);
        bone(shoulder_l, hip_l), bone(shoulder_r, hip_r), bone(shoulder_l, hip_r), bone(shoulder_r, hip_l);
        bone(neck, hip_l, false), bone(neck, hip_r, false);
        bone(head, neck), bone(head, shoulder_l, false, 2e-4), bone(head, shoulder_r, false, 2e-4);
        bone(shoulder_l, elbow_l), bone(elbow_l, hand_l), bone(shoulder_r, elbow_r), bone(elbow_r, hand_r);
        bone(hip_l, knee_l), bone(knee_l, foot_l), bone(hip_r, knee_r), bone(knee_r, foot_r);
    }
    bool is_ball(std::size_t i) const override {
        return system_.points.radius[i] > 0 && !inner_.contains(std::uint32_t(i));
    }
    float kind_of(std::size_t i) const override {
        const std::uint32_t group = system_.points.group[i];
        return group > 2 ? kind(group) : system_.points.radius[i] > 0.05F ? 8 : 6;
    }

    std::uint32_t groups_ = 0;
    std::set<std::uint32_t> inner_;  ///< points inside boxes
};

/// A cloth that is pinned at two corners falls over a ball in the wind.
class Cloth final : public SystemScene<3> {
public:
    Cloth(std::size_t particles, int threads)
        : Cloth(std::size_t(std::lround(std::sqrt(double(checked_number("cloth", particles, 48 * 48, 9, 16'384))))),
                threads, 0) {}

    bool set(std::string_view name, double value) override {
        if (name == "wind")
            wind_ = value;
        else if (name == "drag")
            air_->law.coefficient = float(value);
        else
            return SystemScene::set(name, value);
        return true;
    }
    void step() override {
        const double t = system_.time(), gust = 1 + 0.3 * std::sin(2.3 * t) + 0.15 * std::sin(5.9 * t);
        air_->law.wind = {0, 0, float(wind_ * gust)};
        SystemScene::step();
    }

private:
    Cloth(std::size_t rows, int threads, int)
        : SystemScene({.target = {0, 0.8, 0.55},
                       .lower = {-2.5, 0, -2},
                       .upper = {2.5, 2.4, 3.5},
                       .distance = 4.4,
                       .yaw = 0.5,
                       .pitch = 0.2},
                      rows > 80 ? 6 : 4, threads),
          rows_(rows) {
        constexpr double side = 1.7, weight = 0.2;  // [m], [kg/m²]
        const firn::Net<3> net = firn::cloth({-side / 2, 1.6, 0}, {side, 0, 0}, {0, 0, side}, {rows - 1, rows - 1});
        const double spacing = side / double(rows - 1);
        reach = std::max(0.06, 1.01 * spacing);
        Ball ball{.shape = {0.42F}};
        ball.position = {0.05, 0.42, 0.8};
        obstacles().all.push_back(ball);
        system_.damping = 0.25;
        const std::size_t first = system_.add(
            net, {.masses = firn::facet_masses(net, weight), .radius = std::min(0.4 * spacing, 0.012), .group = 0});
        firn::ConstraintsOfKinds stiffness{};
        stiffness[std::size_t(firn::LinkKind::shear)].compliance = 1e-5;
        stiffness[std::size_t(firn::LinkKind::bend)].compliance = 0.02;
        system_.constraints.add(net, stiffness, first);
        air_ = &system_.add_force(firn::aerodynamic_surface_of(net, firn::AerodynamicDrag<float, 3>{}, first));
        system_.collisions.emplace();
        system_.collisions->exclude(net.links, std::uint32_t(first));
        add_triangles(net.facets, first);
        add_pin(std::uint32_t(first));
        add_pin(std::uint32_t(first + rows - 1));
    }
    /// Stripes, which show how the cloth is folded.
    float kind_of(std::size_t i) const override { return 12 * (i % rows_) / rows_ % 2 ? 0.3F : 0.0F; }

    std::size_t rows_;
    double wind_ = 0;
    firn::AerodynamicSurface<float, 3>* air_ = nullptr;
};

/// Soft balls, cubes and rings fall into a box.
class Pile final : public SystemScene<3> {
public:
    Pile(std::size_t particles, int threads)
        : Pile(int(std::lround(double(checked_number("pile", particles, 1500, 100, 10'000)) / points_a_body) + 1),
               threads, 0) {}

private:
    static constexpr double points_a_body = 118, size = 0.3;

    static double width(int bodies) { return 0.95 * std::cbrt(std::max(bodies, 6) / 13.0); }

    Pile(int bodies, int threads, int)
        : SystemScene({.target = {0, 0.46 * width(bodies), 0},
                       .lower = {-width(bodies) / 2, 0, -width(bodies) / 2},
                       .upper = {width(bodies) / 2, 1.1 * width(bodies), width(bodies) / 2},
                       .distance = 3.3 * width(bodies),
                       .yaw = 0.55,
                       .pitch = 0.33,
                       .is_box = true},
                      8, threads) {
        system_.damping = 0.3;
        reach = 0.06;
        system_.collisions.emplace();
        const std::array<firn::SoftBody<3>, 3> kinds{
            firn::mesh_body(example::sphere_mesh({}, 0.5 * size, 5)),
            firn::lattice_body(firn::sample_box<3>(Point::filled(-0.42 * size), Point::filled(0.42 * size * (1 + 1e-9)),
                                                   {.spacing = 0.84 * size / 4})),
            firn::mesh_body(ring(0.36 * size, 0.2 * size))};
        Noise noise(3);
        const double w = width(bodies);
        const int across = std::max(2, int(w / (1.35 * size)));
        for (int b = 0; b < bodies; ++b) {
            const firn::SoftBody<3>& body = kinds[std::size_t(b % 3)];
            firn::Net<3> net = body.net;
            const auto turned = firn::rotation({noise(), 1.5 + noise(), noise()}, 3.1 * noise());
            const auto place = [&](int k) { return w * ((k + 0.5) / across - 0.5) + 0.02 * noise(); };
            const Point middle{place(b % across), 0.25 + 0.42 * double(b / (across * across)),
                               place(b / across % across)};
            for (Point& x : net.positions) x = middle + turned * x;
            double length = 0, stretch_links = 0, volume = 0;
            for (const firn::Link& link : net.links)
                if (link.kind == firn::LinkKind::stretch) length += firn::rest_length(net, link), ++stretch_links;
            for (const double part : body.volumes) volume += part;
            const double spacing = std::cbrt(volume / double(net.positions.size()));
            const std::size_t first = system_.add(
                net,
                {.masses = body.masses(500), .radius = 0.75 * length / stretch_links, .group = std::uint32_t(b + 1)});
            system_.constraints.add(net, firn::ConstraintOptions{.compliance = 1 / (2e4 * spacing)}, first);
            add_triangles(net.facets, first);
        }
    }
    /// A ring whose middle circle has the radius `large`, and whose cross-section has the radius `small` [m].
    static firn::TriangleMesh ring(double large, double small) {
        constexpr std::int32_t around = 16, across = 8;
        firn::TriangleMesh mesh;
        for (std::int32_t i = 0; i < around; ++i)
            for (std::int32_t j = 0; j < across; ++j) {
                const double a = 2 * pi * i / around, b = 2 * pi * j / across, r = large + small * std::cos(b);
                mesh.vertices.push_back({r * std::cos(a), small * std::sin(b), r * std::sin(a)});
                const auto at = [&](std::int32_t u, std::int32_t v) { return (u % around) * across + v % across; };
                mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
                mesh.triangles.push_back({at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
            }
        return mesh;
    }
    float kind_of(std::size_t i) const override { return float((system_.points.group[i] - 1) % 7); }
};

/// Jets of water rise from a stone into a ring of stones. Seven emitters; Euler's integration.
class Fountain final : public SystemScene<3, firn::SymplecticEuler> {
public:
    Fountain(std::size_t, int threads)
        : SystemScene({.target = {0, 0.55, 0},
                       .lower = {-3, 0, -3},
                       .upper = {3, 4, 3},
                       .distance = 4,
                       .yaw = 0.4,
                       .pitch = 0.3},
                      4, threads) {
        constexpr int stones = 18;
        for (int k = 0; k <= stones; ++k) {
            const double angle = 2 * pi * k / stones, r = k < stones ? 1.15 : 0;
            Ball stone{.shape = {k < stones ? 0.21F : 0.24F}};
            stone.position = {r * std::cos(angle), k < stones ? 0.04 * std::sin(5 * angle) : 0.0, r * std::sin(angle)};
            obstacles().all.push_back(stone);
        }
        system_.collisions.emplace();
        add_drag();
        for (int k = 0; k < 7; ++k) {
            const double angle = 2 * pi * k / 6;
            firn::Emitter<3> jet{.position = {0, 0.27, 0},
                                 .nozzle = 0.05,
                                 .speed = 5,
                                 .mass = mass,
                                 .radius = radius,
                                 .seed = std::uint64_t(k + 1)};
            if (k < 6) {
                jet.position = {0.16 * std::cos(angle), 0.2, 0.16 * std::sin(angle)};
                jet.direction = {0.28 * std::cos(angle), 1, 0.28 * std::sin(angle)};
                jet.nozzle = 0.03;
                jet.speed = 4;
            }
            jets_.push_back(jet);
        }
        set_jets();
    }

    bool set(std::string_view name, double value) override {
        if (name == "rate")
            rate_ = value, set_jets();
        else if (name == "lifespan")
            lifespan_ = value, set_jets();
        else if (name == "maximum")
            maximum_ = value, set_jets();
        else if (name == "variance")
            variance_ = value, set_jets();
        else
            return SystemScene::set(name, value);
        return true;
    }
    void step() override {
        SystemScene::step();
        for (auto& jet : jets_) jet.give(system_.points, system_.time(), system_.gravity);
    }

private:
    static constexpr double radius = 0.014, mass = 250 * 4.0 / 3 * pi * radius * radius * radius;  // foam

    /// Gives the parameters of the page to the emitters, half of the drops to the one in the middle. Births that are
    /// due now are left out.
    void set_jets() {
        for (std::size_t k = 0; k < jets_.size(); ++k) {
            firn::Emitter<3>& jet = jets_[k];
            const double part = k < 6 ? 1.0 / 12 : 0.5;
            jet.rate = part * rate_;
            jet.lifespan = lifespan_;
            jet.lifespan_spread = variance_ * lifespan_;
            jet.speed_spread = 0.3 * variance_ * jet.speed;
            jet.cone = 0.4 * variance_;
            jet.maximum = std::uint64_t(std::max(0.0, std::ceil(part * maximum_)));
            jet.start = system_.time();
            jet.births = 0;
            jet.check();
            if (system_.steps() > 0) jet.skip(system_.time());
        }
    }
    bool is_ball(std::size_t) const override { return true; }
    float kind_of(std::size_t i) const override { return 5 + std::min(0.9F, 0.14F * norm(system_.points.velocity[i])); }

    double rate_ = 1200, lifespan_ = 3, maximum_ = 6000, variance_ = 0.2;
    std::vector<firn::Emitter<3>> jets_;
};

}  // namespace live
