/// \file Every material under uniaxial strain, along a path through all it does, against closed forms of the models'
/// papers (scenes/uniaxial.hpp says which).
#include "../../benchmarks/verification/scenes/uniaxial.hpp"

#include "support/catch.hpp"

using namespace firn;
using namespace verification;

namespace {

template <class Model>
double error_of(const Model& model, const Path& path) {
    return largest_error(driven(model, path), closed(form_of(model), path));
}

}  // namespace

TEST_CASE("Every material under uniaxial strain bears the stress of its closed form, to rounding") {
    const UniaxialModels of;
    CHECK(error_of(of.fixed_corotated, of.of_solid) < 1e-12);
    CHECK(error_of(of.neo_hookean, of.of_solid) < 1e-12);
    CHECK(error_of(of.hencky, of.of_solid) < 1e-12);
    CHECK(error_of(of.fluid, of.of_fluid) < 1e-12);
    CHECK(error_of(of.snow, of.of_snow) < 1e-12);
    CHECK(error_of(of.von_mises, of.of_metal) < 1e-12);
    CHECK(error_of(of.sand, of.of_sand) < 1e-12);
}

TEST_CASE("Cam clay under uniaxial strain yields where its ellipse says, and does not leave it") {
    const UniaxialModels of;
    const NaccForm form = form_of(of.nacc);
    for (const double end : {0.91, 1.05}) {
        CAPTURE(end);
        const NaccErrors errors = nacc_errors(of.nacc, form, end, 2000);
        CHECK(errors.elastic < 1e-12);
        CHECK(errors.yields_at == Approx(form.yields_at(end)).epsilon(5e-5));  // one step
        CHECK(errors.ellipse < 1e-10);
    }
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("A particle of a body that a simulation stretches bears the closed form's stress") {
    const UniaxialModels of;
    CHECK(largest_error(simulated(of.fluid, of.of_fluid), closed(form_of(of.fluid), of.of_fluid)) < 1e-10);
}
#endif
