/// \file A scene of point masses, with a pointer that drags, pins and cuts.
#pragma once

#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/lagrangian/particle_system.hpp>
#include <firn/lagrangian/point_forces.hpp>

#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

namespace live {

template <int D>
Point in_space(const firn::Vec<double, D>& x) {
    return {x[0], x[1], D == 3 ? x[D - 1] : 0.0};
}

/// A cut through the picture: the wedge between two lines of sight from one eye.
class Wedge {
public:
    Wedge(const Ray& a, const Ray& b)
        : eye_(a.from), from_(a.along), to_(b.along), normal_(firn::cross(a.along, b.along)) {}

    /// Returns whether the segment from p to q [m] crosses the wedge.
    bool meets(const Point& p, const Point& q) const {
        const double at_p = dot(p - eye_, normal_), at_q = dot(q - eye_, normal_);
        if (!(at_p * at_q < 0)) return false;
        const Point x = p + (q - p) * (at_p / (at_p - at_q)) - eye_;
        return dot(firn::cross(from_, x), normal_) >= 0 && dot(firn::cross(x, to_), normal_) >= 0;
    }

private:
    Point eye_, from_, to_, normal_;
};

/// A scene of point masses.
///
/// The pointer takes hold of a point and its neighbours within `reach` of the same group. They are pinned while they
/// are held, and their velocity leads them to the pointer.
template <int D, class Integrator = firn::Verlet>
class SystemScene : public Scene {
public:
    using Ball = firn::Collider<firn::Sphere<float, D>>;
    using Boundary = firn::Together<firn::Walls<float, D>, firn::BoundaryList<Ball>>;
    using System = firn::ParticleSystem<D, float, Integrator, Boundary>;
    using V = firn::Vec<float, D>;

    SystemScene(const Stage& stage, int steps_a_frame, int threads) : stage_(stage), dt_(1.0 / 60 / steps_a_frame) {
        system_.threads = threads;
        system_.warn = {};
        system_.boundary = Boundary(room(0.3), {});
    }

    Stage stage() const override { return stage_; }
    std::size_t particles() const override { return system_.points.size(); }
    std::size_t links() const override { return system_.constraints.size(); }
    double time() const override { return system_.time(); }
    double time_step() const override { return dt_; }

    void step() override {
        lead();
        const std::size_t torn = system_.torn().size();
        system_.step(dt_);
        if (system_.torn().size() > torn) follow_torn(torn);
    }

    bool set(std::string_view name, double value) override {
        if (drag_ && name == "wind")
            drag_->law.wind[0] = float(value);
        else if (drag_ && name == "drag")
            drag_->law.coefficient = float(value);
        else if (name == "gravity")
            system_.gravity[1] = -value;
        else if (name == "iterations")
            system_.iterations = int(value);
        else if (name == "friction")
            set_friction(value);
        else if (name == "restitution") {
            system_.restitution = value;
            if (system_.collisions) system_.collisions->restitution = value;
        } else if (name == "tear")
            system_.constraints.tear_factor = value < no_tear ? value : std::numeric_limits<double>::infinity();
        else
            return false;
        return true;
    }

    bool grab(const Ray& ray, double slope) override {
        release();
        const std::ptrdiff_t nearest = meet(ray, slope);
        if (nearest < 0) return false;
        const auto& points = system_.points;
        const Point middle = position(std::size_t(nearest));
        plane_ = {middle, ray.along};
        target_ = middle;
        hand_.push_back({points.id[std::size_t(nearest)], {}});
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Point offset = position(i) - middle;
            const bool is_near = reach > 0 && points.group[i] == points.group[std::size_t(nearest)] &&
                                 norm(offset) <= reach && !points.is_pinned(i);
            if (is_near && std::ptrdiff_t(i) != nearest) hand_.push_back({points.id[i], offset});
        }
        return true;
    }
    void drag(const Ray& ray) override {
        if (hand_.empty()) return;
        const auto& [middle, normal] = plane_;
        const double approach = dot(ray.along, normal);
        if (!(approach > 0.05)) return;
        target_ = ray.from + ray.along * (dot(middle - ray.from, normal) / approach);
        for (int a = 0; a < 3; ++a) target_[a] = std::clamp(target_[a], stage_.lower[a], stage_.upper[a]);
    }
    void release() override {
        for (const Held& one : hand_) {
            if (pins_.contains(one.id))
                system_.points.pin(one.id);
            else if (is_there(one.id))
                system_.points.unpin(one.id);
        }
        hand_.clear();
    }
    int pin(const Ray& ray, double slope) override {
        release();
        const std::ptrdiff_t nearest = meet(ray, slope);
        if (nearest < 0) return 0;
        const std::uint32_t id = system_.points.id[std::size_t(nearest)];
        if (pins_.erase(id) > 0) {
            system_.points.unpin(id);
            return -1;
        }
        add_pin(id);
        return 1;
    }
    std::size_t cut(const Ray& a, const Ray& b) override {
        const Wedge wedge(a, b);
        std::vector<firn::Torn> crossed;
        for (const auto& link : system_.constraints.all())
            if (wedge.meets(position(link.ends[0]), position(link.ends[1]))) crossed.push_back(link.ends);
        if (crossed.empty()) return 0;
        const std::size_t torn = system_.torn().size();
        system_.tear(crossed);
        follow_torn(torn);
        return crossed.size();
    }

    std::vector<Point> positions() const override {
        std::vector<Point> all(system_.points.size());
        for (std::size_t i = 0; i < all.size(); ++i) all[i] = position(i);
        return all;
    }
    std::vector<std::array<std::uint32_t, 2>> link_ends() const override {
        std::vector<std::array<std::uint32_t, 2>> all;
        for (const auto& link : system_.constraints.all()) all.push_back(link.ends);
        return all;
    }
    std::ptrdiff_t held() const override {
        return hand_.empty() ? -1 : std::ptrdiff_t(system_.points.place(hand_.front().id));
    }

    void draw(Picture& picture) override {
        const auto& points = system_.points;
        picture.balls.clear();
        picture.ball_kinds.clear();
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (!is_ball(i)) continue;
            add(picture.balls, position(i));
            // Rods of the same radius end at balls, and cover them.
            picture.balls.push_back(points.radius[i] * (rods_.empty() ? 1.0F : 0.98F));
            picture.ball_kinds.push_back(kind_of(i));
        }
        for (const Ball& ball : obstacles().all) {
            add(picture.balls, in_space<D>(ball.position));
            picture.balls.push_back(0.985F * ball.shape.radius);
            picture.ball_kinds.push_back(obstacle_kind);
        }
        draw_surface(picture);
        picture.rods.clear();
        for (const Rod& rod : rods_) {
            add(picture.rods, position(rod.ends[0]));
            picture.rods.push_back(rod.radius);
            add(picture.rods, position(rod.ends[1]));
            picture.rods.push_back(rod.kind);
        }
        picture.pins.clear();
        for (const std::uint32_t id : pins_) draw_pin(picture, id, 0);
        if (!hand_.empty()) draw_pin(picture, hand_.front().id, 1);
    }

protected:
    static constexpr double no_tear = 3;  ///< a tear factor at which links never tear
    static constexpr float obstacle_kind = 8;

    /// A link that is drawn as a rod.
    struct Rod {
        firn::Torn ends;
        float radius, kind;
    };

    /// Gives every point the drag of the air. The page's wind and drag coefficient then apply to it.
    void add_drag() { drag_ = &system_.add_force(firn::DragOnPoints<float, D>{}); }

    Point position(std::size_t i) const { return in_space<D>(system_.points.position[i]); }
    firn::Walls<float, D> room(double friction) const {
        V lower, upper;
        for (int a = 0; a < D; ++a) lower[a] = float(stage_.lower[a]), upper[a] = float(stage_.upper[a]);
        upper[1] = 50;
        return firn::Walls<float, D>::all(lower, upper, {firn::Contact::separate, friction});
    }
    firn::BoundaryList<Ball>& obstacles() { return std::get<1>(system_.boundary.parts); }
    void add_pin(std::uint32_t id) {
        system_.points.pin(id);
        pins_.insert(id);
    }
    void set_friction(double friction) {
        std::get<0>(system_.boundary.parts) = room(friction);
        for (Ball& ball : obstacles().all) ball.friction = friction;
        if (system_.collisions) system_.collisions->friction = friction;
    }
    /// Adds triangles of points to draw. All their corners get smooth normals.
    void add_triangles(std::span<const std::array<std::uint32_t, 3>> triangles, std::size_t first) {
        for (const auto& [a, b, c] : triangles)
            triangles_.push_back({std::uint32_t(a + first), std::uint32_t(b + first), std::uint32_t(c + first)});
        ++surface_version_;
    }

    /// Whether point i is drawn as a ball.
    virtual bool is_ball(std::size_t) const { return false; }
    virtual float kind_of(std::size_t i) const { return float(system_.points.group[i] % 8); }

    System system_;
    Stage stage_;
    double dt_;        ///< time step [s]
    double reach = 0;  ///< neighbours within this distance of the held point are held, too [m]
    std::vector<Rod> rods_;
    std::vector<std::array<std::uint32_t, 3>> triangles_;

private:
    struct Held {
        std::uint32_t id;
        Point offset;  ///< from the middle of the hand [m]
    };
    struct Plane {
        Point through, normal;
    };

    static void add(std::vector<float>& numbers, const Point& x) {
        for (int a = 0; a < 3; ++a) numbers.push_back(float(x[a]));
    }
    bool is_there(std::uint32_t id) const {
        const auto& ids = system_.points.id;
        return std::binary_search(ids.begin(), ids.end(), id);
    }

    /// Returns the index of the first point on the ray, or -1. A point that is off the ray counts as farther.
    std::ptrdiff_t meet(const Ray& ray, double slope) const {
        std::ptrdiff_t found = -1;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < system_.points.size(); ++i) {
            const Point to = position(i) - ray.from;
            const double depth = dot(to, ray.along);
            if (!(depth > 0)) continue;
            const double off = norm(to - ray.along * depth);
            if (off > std::max(double(system_.points.radius[i]), slope * depth)) continue;
            const double score = depth + 4 * off;
            if (score < least) least = score, found = std::ptrdiff_t(i);
        }
        return found;
    }

    /// Gives the held points the velocity that brings them near the pointer.
    void lead() {
        constexpr double lag = 0.03, fastest = 12;  // [s], [m/s]
        if (hand_.empty()) return;
        std::erase_if(hand_, [&](const Held& one) { return !is_there(one.id); });
        for (const Held& one : hand_) {
            const Point x = position(system_.points.place(one.id));
            Point v = (target_ + one.offset - x) * (1 / std::max(lag, 2 * dt_));
            if (const double speed = norm(v); speed > fastest) v = v * (fastest / speed);
            firn::Vec<double, D> velocity;
            for (int a = 0; a < D; ++a) velocity[a] = v[a];
            system_.points.pin(one.id, velocity);
        }
    }

    /// Removes what is drawn along links that have torn since.
    void follow_torn(std::size_t first) {
        std::set<firn::Torn> links;
        for (const auto& [a, b] : std::span(system_.torn()).subspan(first))
            links.insert({std::min(a, b), std::max(a, b)});
        const auto has_torn = [&](std::uint32_t a, std::uint32_t b) {
            return links.contains({std::min(a, b), std::max(a, b)});
        };
        std::erase_if(rods_, [&](const Rod& rod) { return has_torn(rod.ends[0], rod.ends[1]); });
        const auto gone = std::erase_if(triangles_, [&](const auto& t) {
            return has_torn(t[0], t[1]) || has_torn(t[1], t[2]) || has_torn(t[2], t[0]);
        });
        if (gone > 0) ++surface_version_;
    }

    void draw_surface(Picture& picture) {
        if (picture.surface_version != surface_version_) {
            picture.surface_version = surface_version_;
            picture.triangles.clear();
            for (const auto& corners : triangles_)
                picture.triangles.insert(picture.triangles.end(), corners.begin(), corners.end());
        }
        if (triangles_.empty()) return;
        const auto& points = system_.points;
        normals_.assign(points.size(), Point{});
        for (const auto& [a, b, c] : triangles_) {
            const Point x = position(a), normal = firn::cross(position(b) - x, position(c) - x);
            normals_[a] += normal, normals_[b] += normal, normals_[c] += normal;
        }
        picture.vertices.resize(6 * points.size());
        picture.vertex_kinds.resize(points.size());
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Point x = position(i);
            const double length = norm(normals_[i]), scale = length > 0 ? 1 / length : 0;
            for (int a = 0; a < 3; ++a) {
                picture.vertices[6 * i + std::size_t(a)] = float(x[a]);
                picture.vertices[6 * i + 3 + std::size_t(a)] = float(normals_[i][a] * scale);
            }
            picture.vertex_kinds[i] = kind_of(i);
        }
    }
    void draw_pin(Picture& picture, std::uint32_t id, float is_held) {
        if (!is_there(id)) return;
        add(picture.pins, position(system_.points.place(id)));
        picture.pins.push_back(is_held);
    }

    firn::DragOnPoints<float, D>* drag_ = nullptr;  ///< owned by the system; null: no drag
    std::set<std::uint32_t> pins_;
    std::vector<Held> hand_;
    Plane plane_{};
    Point target_{};
    std::vector<Point> normals_;
    std::uint32_t surface_version_ = 1;
};

}  // namespace live
