/// \file Writes particles as Gaussian splats (Kerbl et al., "3D Gaussian splatting for real-time radiance field
/// rendering", ACM Trans. Graph. 42 (2023)) to a PLY file, with the properties and the order of that paper's program. A
/// Gaussian deforms with its particle (compare Xie et al., "PhysGaussian", CVPR 2024).
#pragma once

#include <firn/core/tensor.hpp>
#include <firn/io/ply.hpp>
#include <firn/math/principal_axes.hpp>
#include <firn/math/rotor.hpp>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Options for writing Gaussian splats.
struct SplatOptions {
    /// Standard deviation of the Gaussian of a particle that is not deformed [m]. 0: half the particle's spacing, the
    /// D-th root of its initial volume, so that the Gaussians of neighbours overlap.
    double radius = 0;
    /// Colour of all particles: red, green and blue, from 0 to 1, as a screen shows them (sRGB).
    Vec<double, 3> colour{0.5, 0.5, 0.5};
    /// Name of the field from which `colour_of` computes colours.
    std::string field{};
    /// Returns the colour of a particle, as `colour`, from the components of its field `field`. Empty: all particles
    /// have the colour `colour`. A series in the background calls this function on its thread.
    std::function<Vec<double, 3>(std::span<const double>)> colour_of{};
    /// Opacity in a Gaussian's centre, more than 0 and less than 1.
    double opacity = 0.95;
    /// Degree of the spherical harmonics in the file, 0 to 3. They are zero, because the colour does not depend on the
    /// direction; but there are viewers that read only files of the degree 3.
    int harmonics = 0;
};

namespace detail {

/// The Gaussian of one particle.
struct Splat {
    Rotor<double, 3> rotation;  ///< (w, x, y, z), w ≥ 0: turns the axes to the Gaussian's
    Vec<double, 3> deviations;  ///< standard deviations along the Gaussian's axes [m]
};

/// Returns the Gaussian with the covariance F Σ₀ Fᵀ of a Gaussian with Σ₀ = radius² I.
inline Splat splat_of(const Mat<double, 3>& F, double radius) {
    const Principal<double, 3> p = principal_stretches(F);
    Splat splat{rotor_of(p.directions), p.stretches * radius};
    splat.deviations[2] = std::abs(splat.deviations[2]);  // its sign is that of det F
    return splat;
}

/// Returns the matrix of a particle that its fields describe: the deformation gradient, or J^{1/D} I of a fluid.
/// \param F  field of the deformation gradient, D × D or 3 × 3 components, or nullptr
/// \param J  field of the volume ratio, or nullptr
template <class S>
Mat<double, 3> deformation_at(const StateField<S>* F, const StateField<S>* J, int dimension, std::size_t i) {
    Mat<double, 3> matrix = Mat<double, 3>::identity();
    if (F) {
        const int n = F->components == 9 ? 3 : 2;
        for (int r = 0; r < n; ++r)
            for (int c = 0; c < n; ++c)
                matrix(r, c) = double(F->values[i * std::size_t(n * n) + std::size_t(n * r + c)]);
    } else if (J) {
        matrix = matrix * std::pow(double(J->values[i]), 1.0 / dimension);
    }
    return matrix;
}

}  // namespace detail

/// Writes the particles of a state as Gaussian splats to a PLY file of binary floats: position x y z [m] (z = 0 in 2D),
/// nx ny nz = 0, colour f_dc = (c − ½) / 0.28209, opacity as logit ln(o / (1 − o)), scale_0 … scale_2 = logarithm of
/// the standard deviations [m] along the axes, and rot_0 … rot_3 = unit quaternion (w, x, y, z) with w ≥ 0.
///
/// The covariance of a particle is Σ = F Σ₀ Fᵀ with Σ₀ = SplatOptions::radius² I, where F is the field
/// `deformation_gradient`. A particle without F but with the field `volume_ratio` J (a fluid) is a ball of J times the
/// volume; one without both is a ball.
///
/// In 2D, F is 1 across the plane. If writing fails, no incomplete file is left (see AtomicFile).
/// \throws parameter_error  if the parts of the state do not fit together (see check_state()), if the state lacks the
///                          field `options.field`, or `volume` while options.radius is 0, if an option or a colour is
///                          outside its range, if a value is not finite, if F has a stretch of 0 or J is not positive,
///                          or if the state has more than 2³¹ − 1 points
/// \throws io_error         if writing fails
template <state_scalar S>
void write_splats(const std::filesystem::path& path, const State<S>& state, const SplatOptions& options = {}) {
    check_state(state);
    detail::check_ply_size(state.size());
    if (!(options.radius >= 0) || !std::isfinite(options.radius))
        throw parameter_error(sentence("SplatOptions::radius is ", options.radius,
                                       " m; give a standard deviation, or 0 for half the spacing of the particles."));
    if (!(options.opacity > 0) || !(options.opacity < 1))
        throw parameter_error(
            sentence("SplatOptions::opacity is ", options.opacity, "; give more than 0 and less than 1."));
    if (options.harmonics < 0 || options.harmonics > 3)
        throw parameter_error(sentence("SplatOptions::harmonics is ", options.harmonics, "; give 0 to 3."));

    const StateField<S>* position = &state.field("position");
    const StateField<S>* F = state.find("deformation_gradient");
    const StateField<S>* J = F ? nullptr : state.find("volume_ratio");
    const StateField<S>* volume = options.radius > 0 ? nullptr : &state.field("volume");
    const StateField<S>* of_colour = options.colour_of ? &state.field(options.field) : nullptr;
    const int D = state.dimension;
    if (F && F->components != 9 && !(D == 2 && F->components == 4))
        throw parameter_error(sentence("The field 'deformation_gradient' has ", F->components,
                                       " components; splats need those of a matrix."));
    for (const StateField<S>* field : {position, F, J, volume, of_colour})
        if (field) detail::check_finite(state, *field, "splats");

    std::vector<detail::PlyProperty> properties;
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"})
        properties.push_back({"float", name});
    const int rest = 3 * ((options.harmonics + 1) * (options.harmonics + 1) - 1);
    for (int k = 0; k < rest; ++k) properties.push_back({"float", "f_rest_" + std::to_string(k)});
    for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        properties.push_back({"float", name});
    AtomicFile file(path);
    file.write(detail::ply_header(sentence("Gaussian splats, positions in metres, after ", state.time, " seconds"),
                                  state.size(), properties));

    constexpr double zonal = 0.28209479177387814;  // the spherical harmonic of degree 0: 1 / (2 √π)
    const auto logit = float(std::log(options.opacity / (1 - options.opacity)));
    std::string bytes;
    std::vector<double> values;
    for (std::size_t i = 0; i < state.size(); ++i) {
        const auto refuse = [&](const char* what, double number, const char* advice) {
            throw parameter_error(sentence("Particle ", state.id[i], " has ", what, " of ", number, advice));
        };
        double radius = options.radius;
        if (volume) {
            radius = 0.5 * std::pow(double(volume->values[i]), 1.0 / D);
            if (!(radius > 0)) refuse("a volume", double(volume->values[i]), "; give SplatOptions::radius.");
        }
        if (J && !(J->values[i] > 0)) refuse("a volume ratio", double(J->values[i]), "; a splat needs more than 0.");
        const detail::Splat splat = detail::splat_of(detail::deformation_at(F, J, D, i), radius);
        if (!(splat.deviations[2] > 0)) refuse("a principal stretch", 0, "; a splat needs one of more than 0.");
        Vec<double, 3> colour = options.colour;
        if (of_colour) {
            const auto n = std::size_t(of_colour->components);
            values.assign(of_colour->values.begin() + std::ptrdiff_t(i * n),
                          of_colour->values.begin() + std::ptrdiff_t((i + 1) * n));
            colour = options.colour_of(values);
        }
        for (const double c : colour.v)
            if (!(c >= 0) || !(c <= 1)) refuse("a colour", c, "; give red, green and blue from 0 to 1.");

        bytes.clear();
        const auto put = [&](double number) { detail::append_little_endian(bytes, float(number)); };
        for (int a = 0; a < 3; ++a) put(a < D ? double(position->values[i * std::size_t(D) + std::size_t(a)]) : 0);
        for (int a = 0; a < 3; ++a) put(0);
        for (const double c : colour.v) put((c - 0.5) / zonal);
        for (int k = 0; k < rest; ++k) put(0);
        put(double(logit));
        for (const double deviation : splat.deviations.v) put(std::log(deviation));
        for (const double q : splat.rotation.v) put(q);
        file.write(bytes);
    }
    file.commit();
}

}  // namespace firn::inline FIRN_BUILD
