// quick: no
/// \file Softening that is scaled by the cell size: a simulation gives the bits of a model with the scaled strain.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include <memory>

namespace softening_band_tests {

using namespace firn;

namespace {

const auto soil = MohrCoulomb<float>::from_properties(
    {.young = 1e6, .cohesion = 2e3, .tension = 1e3, .residual_cohesion = 2e2, .softening_strain = 0.05});

template <int D, class M>
auto fallen(const M& model, double cell_size) {
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1), cell_size};
    auto simulation = std::make_unique<Simulation<D, M>>(domain, model);
    simulation->add(
        sample_box<D>(Vec<double, D>::filled(0.25), Vec<double, D>::filled(0.5), {.spacing = cell_size / 2}), 1500,
        Vec<double, D>::filled(-8));
    simulation->fixed_time_step = 2e-4;
    for (int i = 0; i < 250; ++i) simulation->step();
    return simulation;
}

/// The numbers of F of all particles, and how many have softened.
template <class S>
std::vector<float> strains(const S& simulation, std::size_t& softened) {
    std::vector<float> all;
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto state = particles.state(slot);
        for (const float x : state.F.m) all.push_back(x);
        all.push_back(state.plastic_strain);
        softened += state.plastic_strain > 0;
    }
    return all;
}

template <int D, template <class> class Wrapper>
void check(double cell_size, float band_width) {
    using Model = MohrCoulomb<float>;
    Wrapper<SofteningBand<Model>> scaled;
    static_cast<SofteningBand<Model>&>(scaled) = {soil, band_width};
    Wrapper<Model> by_hand;
    static_cast<Model&>(by_hand) = soil;
    const auto unscaled = by_hand;
    by_hand.softening_strain = scaled.softening_strain_in(float(cell_size));
    CHECK(by_hand.softening_strain == Approx(0.05 * double(band_width) / cell_size).epsilon(1e-6));
    std::size_t softened = 0, of_other = 0;
    const auto a = strains(*fallen<D>(scaled, cell_size), softened);
    const auto b = strains(*fallen<D>(by_hand, cell_size), of_other);
    const auto c = strains(*fallen<D>(unscaled, cell_size), of_other);
    REQUIRE(a.size() == b.size());
    CHECK(a == b);
    CHECK(a != c);
    CHECK(softened > a.size() / (4 * (D * D + 1)));
}
template <class Model>
using Itself = Model;

}  // namespace

TEST_CASE("a simulation scales the softening strain by its cell size", "[material]") {
    check<2, Itself>(1. / 32, 0.01F);
    check<3, Itself>(1. / 16, 0.02F);
    check<2, PlaneStrain>(1. / 32, 0.01F);
}

TEST_CASE("a band without a width is refused", "[material][error]") {
    using Band = SofteningBand<MohrCoulomb<float>>;
    CHECK(Band::name == std::string("softening_band_mohr_coulomb"));
    for (const float width : {0.F, -1.F}) {
        const Band band{soil, width};
        CHECK(test_support::holds(test_support::message<parameter_error>([&] { band.check(); }),
                                  "The width of a shear band is"));
    }
    CHECK_NOTHROW(Band{}.check());
}

}  // namespace softening_band_tests
