/// \file Which particles a step has spoiled. They are looked for once it is known that there are some.
#pragma once

#include <firn/data/check_particles.hpp>
#include <firn/exec/places.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace firn::detail {

/// Particles that are not finite, or would have moved more than a cell beyond the domain.
struct WrongParticles {
    std::size_t count = 0, of = 0;  ///< wrong ones, of how many
    std::string first;              ///< what is known of the one with the lowest id
    std::string further;            ///< the next few ids, or nothing

    /// "3 of 100 particles …", to be followed by a cause.
    [[gnu::cold]] std::string text() const {
        const std::string total = sentence(of, of == 1 ? " particle" : " particles");
        if (count == 0) return sentence("One of ", total, " is not finite, or has left the domain.");
        return sentence(count, " of ", total, count == 1 ? " is" : " are",
                        " not finite, or left the domain. The first is ", first,
                        further.empty() ? "." : sentence("; further ids: ", further, "."));
    }
};

/// One particle of a view, with what a sentence can say of it.
template <class View, class Material>
class ParticleLook {
    using S = typename View::scalar_type;
    using P = native_pack<S>;
    using State = typename View::state_type;
    static constexpr int D = View::dimension;

public:
    /// \param domain  null: not known
    /// \param dt      of the step that it came from [s]; 0: of none
    ParticleLook(const View& view, const BlockPartition<D>& partition, const BlockRange<D>& range, std::size_t slot,
                 const Domain<D>* domain, double cell_size, const Material& material, double dt)
        : view_(view),
          range_(range),
          domain_(domain),
          cell_size_(cell_size),
          material_(material),
          slots_{slot, partition.order.data() + slot},
          dt_(dt) {}

    bool is_finite() const { return not_finite().empty(); }

    /// Is it at a face of the domain, where G2P put it, and moves as if it had passed through it by a cell?
    [[gnu::cold]] bool left(bool by_velocity) const {
        if (!domain_ || !(dt_ > 0)) return false;
        const Positions<View> positions(*domain_);
        Vec<S, D> block{};
        for (int a = 0; a < D; ++a) block[a] = S(block_size * range_.block[std::size_t(a)]);
        const Vec<S, D> lowest = positions.lowest(block), highest = positions.highest(block);
        bool left = false;
        for (int a = 0; a < D; ++a) {
            const S x = view_.position.at(slots_, a);
            const bool low = x <= lowest[a], high = x >= highest[a];
            const double moved = dt_ * double(view_.velocity.at(slots_, a));
            left = left || ((low || high) && (!by_velocity || (low ? -moved : moved) > cell_size_));
        }
        return left;
    }

    /// "particle 7 at (1, 2) m with velocity (3, 4) m/s, J = 1: its stress is not finite"
    [[gnu::cold]] std::string text(std::uint32_t id) const {
        const std::string wrong = not_finite();
        return state_text(id) + ": " + (wrong.empty() ? "it has left the domain" : wrong);
    }

    /// "particle 7 at (1, 2) m with velocity (3, 4) m/s, J = 1"
    [[gnu::cold]] std::string state_text(std::uint32_t id) const {
        const auto position = [&](std::size_t, int a) {
            const double x = double(view_.position.at(slots_, a));
            return Positions<View>::in_cells ? position_of_place(*domain_, range_.block, a, x) : x;
        };
        const auto velocity = [&](std::size_t, int a) { return double(view_.velocity.at(slots_, a)); };
        const bool is_known = domain_ || !Positions<View>::in_cells;
        return sentence("particle ", id, is_known ? " at " + point_text(0, D, position) + " m" : "", " with velocity ",
                        point_text(0, D, velocity), " m/s", volume_text());
    }

    /// |v| + c [m/s], that the bound of the time step comes from. \see firn::signal_speed
    double signal_speed() const { return double(lane_value(speed(lift<P>(material_)), 0)); }
    double velocity() const {  ///< |v| [m/s]
        double square = 0;
        for (int a = 0; a < D; ++a) square += std::pow(double(view_.velocity.at(slots_, a)), 2);
        return std::sqrt(square);
    }
    /// Of sound in matter of its density that is not deformed [m/s].
    double undeformed_speed() const {
        const P density = P(view_.mass.at(slots_, 0)) / P(view_.volume.at(slots_, 0));
        const auto lifted = lift<P>(material_);
        return double(lane_value(wave_speed(lifted, density, initial_state<D>(lifted)), 0));
    }

private:
    template <class Field>
    bool is_finite(const Field& field, int components) const {
        bool finite = true;
        for (int k = 0; k < components; ++k) finite = finite && std::isfinite(double(field.at(slots_, k)));
        return finite;
    }

    /// "not finite: its velocity, its stress", or nothing
    [[gnu::cold]] std::string not_finite() const {
        std::string text;
        const auto look = [&](std::string name, const auto& field, int components) {
            if (is_finite(field, components)) return;
            std::replace(name.begin(), name.end(), '_', ' ');
            text += (text.empty() ? "not finite: its " : ", its ") + name;
        };
        look("position", view_.position, D);
        look("velocity", view_.velocity, D);
        for_state([&](const char* name, const auto& field, auto components) { look(name, field, components); });
        look("stress", view_.stress, symmetric_size<D>);
        if (text.empty() && !std::isfinite(signal_speed())) text = "not finite: the speed of waves in it";
        return text;
    }

    /// In lanes, in which every model is used; all of them alike.
    template <class Lifted>
    P speed(const Lifted& material) const {
        material_state_t<Lifted, D> state;
        constexpr auto members = decltype(state)::fields();
        unroll<int(std::tuple_size_v<decltype(members)>)>([&](auto f) {
            auto& member = state.*(std::get<f>(members).member);
            for (int k = 0; k < component_count<std::remove_cvref_t<decltype(member)>>; ++k)
                components(member)[k] = P(view_.state[f].at(slots_, k));
        });
        Vec<P, D> velocity;
        for (int a = 0; a < D; ++a) velocity[a] = P(view_.velocity.at(slots_, a));
        return firn::signal_speed(material, velocity, P(view_.mass.at(slots_, 0)), P(view_.volume.at(slots_, 0)), state,
                                  P(S(cell_size_)));
    }

    /// ", J = 1" of the first matrix of the state, the deformation gradient; nothing where there is none.
    std::string volume_text() const {
        std::string text;
        for_state([&](const char*, const auto& field, auto components) {
            if constexpr (components == D * D) {
                Mat<double, D> F{};
                for (int k = 0; k < D * D; ++k) F.m[k] = double(field.at(slots_, k));
                if (text.empty()) text = sentence(", J = ", determinant(F));
            }
        });
        return text;
    }

    template <class F>
    void for_state(const F& f) const {
        constexpr auto members = State::fields();
        unroll<int(std::tuple_size_v<decltype(State::fields())>)>([&](auto i) {
            constexpr auto member = std::get<i>(members);
            using Value = std::remove_cvref_t<decltype(std::declval<State>().*(member.member))>;
            f(member.name, view_.state[i], std::integral_constant<int, component_count<Value>>{});
        });
    }

    const View& view_;
    const BlockRange<D>& range_;
    const Domain<D>* domain_;
    double cell_size_;
    const Material& material_;
    Slots slots_;
    double dt_;
};

/// Looks at all particles of a set.
/// \param domain  null: not known
/// \param dt      of the step that they come from [s]; 0: of none, they were set so
template <int D, class View, class Material>
[[gnu::cold]] WrongParticles wrong_particles(const View& view, const BlockPartition<D>& partition,
                                             const Domain<D>* domain, double cell_size, const Material& material,
                                             double dt) {
    struct Found {
        std::uint32_t id;
        std::size_t slot, range;
    };
    std::vector<Found> found;
    const auto look_at = [&](const Found& one) {
        return ParticleLook<View, Material>(view, partition, partition.ranges[one.range], one.slot, domain, cell_size,
                                            material, dt);
    };
    const auto find = [&](const auto& is_wrong) {
        for (std::size_t r = 0; r < partition.ranges.size(); ++r) {
            const BlockRange<D>& range = partition.ranges[r];
            for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot) {
                const Found one{partition.order[slot], slot, r};
                if (one.id != no_particle && is_wrong(look_at(one))) found.push_back(one);
            }
        }
    };
    find([](const auto& look) { return !look.is_finite() || look.left(true); });
    // A scheme that blends keeps another velocity than that which moves it.
    if (found.empty()) find([](const auto& look) { return look.left(false); });

    WrongParticles wrong{found.size(), partition.particles, {}, {}};
    if (found.empty()) return wrong;
    const auto few = found.begin() + std::ptrdiff_t(std::min<std::size_t>(found.size(), 5));
    std::partial_sort(found.begin(), few, found.end(), [](const Found& a, const Found& b) { return a.id < b.id; });
    wrong.first = look_at(found.front()).text(found.front().id);
    for (auto next = found.begin() + 1; next != few; ++next)
        wrong.further += sentence(wrong.further.empty() ? "" : ", ", next->id);
    if (found.size() > 5) wrong.further += ", …";
    return wrong;
}

}  // namespace firn::detail
