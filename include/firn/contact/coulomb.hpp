/// \file Contact with Coulomb friction, and its kin: stick and slip without parting.
#pragma once

#include <firn/boundary/contact.hpp>
#include <firn/contact/concept.hpp>
#include <firn/core/error.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// How the matter of two contact groups may move at their common surface.
struct PairContact {
    /// Contact::separate: no penetration, and no traction in tension. Contact::slip: as `separate`, but surfaces that
    /// have touched part no more. Contact::stick: surfaces that have touched neither part nor slide. Contact::none: the
    /// groups pass through each other.
    Contact contact = Contact::separate;
    double friction = 0;  ///< Coulomb's friction coefficient μ [1]
    double reach = 0.25;  ///< For `slip` and `stick`: the gap up to which surfaces count as touching [cells].
};

/// Contact between groups: surfaces do not penetrate each other, part freely, and slide with Coulomb friction.
///
/// Let w be the velocity of one group relative to the other, g the gap between their surfaces [m], and n the normal
/// between them. Surfaces may approach by g in a step, so the law of boundaries acts on w + n max(g, 0)/dt.
/// \see velocity_after_contact
///
///     CoulombContact contact{.friction = 0.3};                    // for all pairs of groups
///     contact.set_pair(1, 2, {.friction = 0.6});                  // for groups 1 and 2
///     contact.set_pair(2, 3, {.contact = Contact::stick});
struct CoulombContact {
    static constexpr const char* name = "coulomb_contact";
    static constexpr bool between_groups = true;  ///< Groups of matter meet by this law.

    /// A pair of groups with a contact of its own.
    struct Pair {
        int first,            ///< the lower number of a group
            second;           ///< the higher number of a group
        PairContact contact;  ///< the contact of these two groups
    };

    double friction = 0;                                  ///< Coulomb's friction coefficient μ of all other pairs [1]
    ContactNormals normals = ContactNormals::regression;  ///< How normals are found.
    std::vector<Pair> pairs{};                            ///< Pairs with a contact of their own. \see set_pair

    /// Gives two groups a contact of their own.
    /// \throws parameter_error  if both groups are the same, if one is negative, if the pair has a contact of its own
    ///                          already, or if a parameter of the contact is out of range
    void set_pair(int a, int b, const PairContact& contact) {
        if (a == b || a < 0 || b < 0)
            throw parameter_error(sentence("The groups ", a, " and ", b,
                                           " are given a contact; give two different groups, counted from 0."));
        const auto [first, second] = std::minmax({a, b});
        if (find(a, b))
            throw parameter_error(
                sentence("The groups ", first, " and ", second, " are given a contact twice; give it once."));
        pairs.push_back({first, second, contact});
        check();
    }

    /// Returns the contact of two groups, given in any order.
    PairContact of_pair(int a, int b) const {
        const Pair* const pair = find(a, b);
        return pair ? pair->contact : PairContact{.friction = friction};
    }

    /// Returns the largest reach of the pairs that stay together [cells].
    double largest_reach() const {
        double largest = 0;
        for (const Pair& pair : pairs)
            if (holds(pair.contact.contact)) largest = std::max(largest, pair.contact.reach);
        return largest;
    }

    /// Returns the parameters as text: "friction 0.3, normals by regression; 1 and 2: stick, friction 0, reach 0.25".
    /// \param exactly  whether numbers have all of their digits, rather than up to nine
    std::string description(bool exactly = false) const {
        const auto digits = [&](double number) { return detail::number_text(number, exactly); };
        std::string text = sentence("friction ", digits(friction), ", normals by ",
                                    normals == ContactNormals::regression ? "regression" : "volume gradient");
        for (const Pair& pair : pairs)
            text += sentence("; ", pair.first, " and ", pair.second, ": ", name_of(pair.contact.contact), ", friction ",
                             digits(pair.contact.friction), ", reach ", digits(pair.contact.reach));
        return text;
    }

    /// Checks the friction and the reach of all pairs.
    /// \throws parameter_error  if one is negative or not finite
    void check() const {
        const auto look = [](const PairContact& of) {
            if (!(of.friction >= 0) || !std::isfinite(of.friction))
                throw parameter_error(sentence("The friction between contact groups is ", of.friction,
                                               "; Coulomb's coefficient must be finite and not negative."));
            if (!(of.reach >= 0) || !std::isfinite(of.reach))
                throw parameter_error(
                    sentence("The reach of a contact is ", of.reach, " cells; it must be finite and not negative."));
        };
        look({.friction = friction});
        for (const Pair& pair : pairs) look(pair.contact);
    }

    /// Returns the velocity of group a relative to group b after contact [m/s].
    template <std::floating_point S, int D>
    Vec<S, D> relative_velocity(int a, int b, const Meeting<S, D>& at) const {
        const PairContact of = of_pair(a, b);
        return velocity_after_contact(at.velocity, at.normal, of.contact, S(of.friction), at.gap,
                                      S(of.reach) * at.cell_size, at.dt);
    }

private:
    /// Returns the pair of two groups that has a contact of its own; nullptr if there is none.
    const Pair* find(int a, int b) const {
        const auto [first, second] = std::minmax({a, b});
        for (const Pair& pair : pairs)
            if (pair.first == first && pair.second == second) return &pair;
        return nullptr;
    }
};

static_assert(contact_law<CoulombContact>);

}  // namespace firn::inline FIRN_BUILD
