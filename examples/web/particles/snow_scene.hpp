/// \file A scene of the material point method: a snowball breaks on a tower of snow, or jelly falls on jelly.
#pragma once

#include <firn/field/attraction.hpp>
#include <firn/material/snow.hpp>
#include <firn/simulation.hpp>

#include "scene.hpp"

#include <cmath>

namespace live {

/// Particles of one material in a box. The pointer pulls them towards the line of sight.
/// \tparam Material  firn::Snow<float> or firn::FixedCorotated<float>
template <class Material>
class GridScene final : public Scene {
    static constexpr bool is_snow = std::is_same_v<Material, firn::Snow<float>>;

public:
    GridScene(std::size_t particles, int threads)
        : GridScene(shapes(checked_number(is_snow ? "snow" : "jelly", particles, 8000, 500, 50'000)), threads) {}

    Stage stage() const override {
        return {.target = {1, 0.38, 0.5},
                .lower = {0, 0, 0},
                .upper = {2, 0.9, 1},
                .distance = 2.75,
                .yaw = is_snow ? -0.45 : 0.5,
                .pitch = 0.25,
                .is_box = true};
    }
    std::size_t particles() const override { return simulation_.particles().size(); }
    double time() const override { return simulation_.time(); }
    double time_step() const override { return simulation_.fixed_time_step; }
    void step() override { simulation_.step(pull_); }

    bool set(std::string_view name, double value) override {
        if (name == "gravity")
            pull_.gravity = {0, float(-value), 0};
        else if (name == "friction")
            for (auto* faces : {&simulation_.boundary.at_lower, &simulation_.boundary.at_upper})
                for (firn::Wall& wall : *faces) wall.friction = value;
        else
            return false;
        return true;
    }

    bool grab(const Ray& ray, double) override {
        is_held_ = true;
        drag(ray);
        pull_.strength = 90;
        return true;
    }
    void drag(const Ray& ray) override {
        if (!is_held_) return;
        const Point to = stage().target - ray.from;
        pull_.centre = firn::cast<double>(ray.from + ray.along * dot(to, ray.along));
        pull_.direction = firn::cast<float>(ray.along);
    }
    void release() override {
        is_held_ = false;
        pull_.strength = 0;
    }

    std::vector<Point> positions() const override {
        const auto& particles = simulation_.particles();
        std::vector<Point> all;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.id(slot) != firn::no_particle) all.push_back(particles.exact_position(slot));
        return all;
    }
    void draw(Picture& picture) override {
        const auto& particles = simulation_.particles();
        picture.balls.clear();
        picture.ball_kinds.clear();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            const std::uint32_t id = particles.id(slot);
            if (id == firn::no_particle) continue;
            const auto x = particles.position(slot);
            picture.balls.insert(picture.balls.end(), {x[0], x[1], x[2], radius_});
            const float body = id < first_body_ ? 0 : 1;
            picture.ball_kinds.push_back(is_snow ? 7 + 0.06F * float(id % 5) : 2 * body);
        }
    }

private:
    struct Shapes {
        double spacing;
        firn::Samples<3> first, second;
    };
    static Shapes shapes(std::size_t particles) {
        const double volume =
            is_snow ? 4.0 / 3 * 3.1416 * 0.17 * 0.17 * 0.17 + 0.24 * 0.62 * 0.42 : 0.4 * 0.3 * 0.4 + 0.027;
        Shapes made{std::cbrt(volume / double(particles)), {}, {}};
        const firn::SamplingOptions filling{.spacing = made.spacing, .pattern = firn::Pattern::jittered};
        if constexpr (is_snow) {
            made.first = firn::sample_sphere<3>({0.4, 0.62, 0.5}, 0.17, filling);
            made.second = firn::sample_box<3>({1.15, 0.001, 0.29}, {1.39, 0.62, 0.71}, filling);
        } else {
            made.first = firn::sample_box<3>({0.8, 0.05, 0.3}, {1.2, 0.35, 0.7}, filling);
            made.second = firn::sample_box<3>({0.95, 0.6, 0.35}, {1.25, 0.9, 0.65}, filling);
        }
        return made;
    }

    GridScene(const Shapes& made, int threads)
        : simulation_({{0, 0, 0}, {2, 0.9, 1}, 2 * made.spacing}, material(), {threads},
                      firn::Walls<float, 3>::all({0, 0, 0}, {2, 0.9F, 1}, {firn::Contact::separate, 0.4})),
          radius_(float((is_snow ? 0.72 : 0.62) * made.spacing)),
          first_body_(std::uint32_t(made.first.positions.size())) {
        simulation_.warn = {};
        const firn::Body first = simulation_.add(made.first, density, is_snow ? Point{8, 0.9, 0} : Point{});
        const firn::Body second = simulation_.add(made.second, density, is_snow ? Point{} : Point{-0.3, -1, 0});
        for (const firn::Body& body : {first, second}) weaken(body);
        constexpr double frame = 1.0 / 60;
        // The speed of sound of the stiffest matter, and of the matter, stays below `fastest`.
        constexpr double fastest = is_snow ? 60 : 9;  // [m/s]
        simulation_.fixed_time_step = frame / std::ceil(frame / (0.3 * 2 * made.spacing / fastest));
        pull_.radius = 0.22F;
    }
    /// Makes lumps of the snow harder than what is between them, so that it breaks there.
    void weaken(const firn::Body& body) {
        if constexpr (is_snow) {
            constexpr double lump = 0.025, variation = 0.053;  // [m]; of the plastic volume ratio
            std::array<std::array<double, 4>, 16> waves{};
            firn::RandomSequence random(9);
            for (auto& wave : waves)
                for (double& k : wave) k = 2 * firn::unit_interval(random.bits()) - 1;
            simulation_.set_states(body, [&](const Point& x, auto& state) {
                double sum = 0;
                for (const auto& [a, b, c, phase] : waves)
                    sum += std::cos((a * x[0] + b * x[1] + c * x[2]) / lump + 6 * phase);
                state.plastic_volume = float(1 - variation * sum);
            });
        }
    }
    static constexpr double density = is_snow ? 400 : 1000;
    static Material material() {
        if constexpr (is_snow) {
            Material snow = Material::from_properties({.critical_stretch = 3e-3});
            snow.largest_exponent = 2;
            return snow;
        } else {
            return Material::from_young_poisson(3e4, 0.3);
        }
    }

    firn::Simulation<3, Material> simulation_;
    firn::Attraction<float, 3> pull_{};
    float radius_;
    std::uint32_t first_body_;
    bool is_held_ = false;
};

}  // namespace live
