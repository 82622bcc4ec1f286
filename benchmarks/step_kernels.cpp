/// \file The two cubes with cubic B-splines, and with forces from the weights' gradients:
/// step/two_cubes_cubic/coloured/threads:N and _gradient.
#include "step.hpp"

namespace {
const bool cubic = scenes::add_two_cubes<float, firn::Apic, 3, firn::MlsForce, firn::CubicBSpline>("two_cubes_cubic");
const bool gradient = scenes::add_two_cubes<float, firn::Apic, 3, firn::WeightGradientForce>("two_cubes_gradient");
}  // namespace
