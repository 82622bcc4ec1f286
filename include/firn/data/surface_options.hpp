/// \file What the surface of particles is computed from, and what it is: the types of firn/data/surface.hpp.
#pragma once

#include <firn/core/tensor.hpp>
#include <firn/data/mesh.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// How a surface is computed. A spacing is the third root of a particle's volume.
struct SurfaceOptions {
    /// Side of the cells that are searched for the surface [m]. 0: half of the spacing. Features of less than two cells
    /// may be missed.
    double cell_size = 0;
    /// Radius of the kernel around a particle [spacings], 1.2 to 10. A larger one gives a smoother surface.
    double radius = 3;
    /// Value of the field on the surface, 0.05 to 0.95. 1/2 keeps volumes; less adds matter.
    double level = 0.5;
    /// Radius of the kernel of a particle that is alone, and across sheets and strands [spacings], 0.5 to `radius`.
    double least_radius = 1.1;
    /// How far F is believed [1], 1 to 10: an axis is stretched or shortened at most by this factor at equal volume,
    /// and the volume changes at most by this factor. F of particles that have been torn off means little.
    double largest_stretch = 2;
    /// Cavities of up to this volume are filled [volumes of a particle]; 0: none is.
    double filled = 8;
    /// How many times the mesh is smoothed (Taubin 1995), 0 to 100. This evens out the triangles; it keeps the volume.
    int smoothing = 2;
    /// Whether particles without neighbours, such as drops, have surfaces of their own.
    bool separate = true;
    /// Number of threads, 1 to 65535; 0: as many as firn takes. The surface does not depend on it.
    int threads = 0;
};

/// One quantity at points, such as the velocity.
struct SurfaceField {
    std::string name;            ///< name of the field
    std::string unit;            ///< unit, such as "m/s"; "1" if the quantity has none
    int components = 1;          ///< numbers for each point
    std::vector<double> values;  ///< the numbers, point by point
};

/// The particles of which a surface is wanted, as arrays of the calling program, which must be there during the call.
struct SurfaceParticles {
    std::span<const Vec<double, 3>> positions;  ///< positions [m]
    /// volumes [m³], or one volume for all: of the undeformed particles if there are deformation gradients, else as
    /// they are
    std::span<const double> volumes;
    std::span<const Mat<double, 3>> deformation_gradients{};  ///< the whole F of each particle [1], or empty
    std::span<const SurfaceField> fields{};                   ///< what the surface shall carry, or empty
};

/// A closed surface: its vertices and triangles, with normals and fields on the vertices. write_obj() writes it, and
/// write_ply() of firn/io/surface.hpp.
struct SurfaceMesh : TriangleMesh {
    std::vector<Vec<double, 3>> normals;  ///< unit vectors outwards, one for each vertex
    std::vector<SurfaceField> fields;     ///< as given, one value for each vertex
    /// Particles without neighbours (indices into the positions, or ids of a set, in ascending order): what a renderer
    /// may show as spray. They are balls of their own, or left out. \see SurfaceOptions::separate
    std::vector<std::uint32_t> alone;
};

}  // namespace firn::inline FIRN_BUILD
