/// \file The straightforward code that firn is measured against: MLS-MPM (Hu et al. 2018) with APIC, quadratic
/// B-splines and fixed corotated elasticity, in float, as one writes it after the paper with Eigen: an array of
/// particles, a dense grid, one thread. It shares no line with firn.
#pragma once

#include <Eigen/Dense>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace baseline {

struct Particle {
    Eigen::Vector3f x, v;  ///< position [m], velocity [m/s]
    Eigen::Matrix3f C, F;  ///< affine velocity field [1/s], deformation gradient [1]
};

/// Particles of one mass and material in a unit box, whose faces are walls without friction that matter may leave.
class MlsMpm {
public:
    std::vector<Particle> particles;
    Eigen::Vector3f gravity{0, -9.81f, 0};  ///< [m/s²]

    /// \param cells  along each axis;  \param mass, volume  of each particle [kg], [m³]
    /// \param young, poisson  Young's modulus [Pa], Poisson's ratio
    MlsMpm(int cells, double mass, double volume, double young, double poisson)
        : cells_(cells),
          side_(std::size_t(cells) + 3),
          h_(1 / float(cells)),
          mass_(float(mass)),
          volume_(float(volume)),
          mu_(float(young / (2 * (1 + poisson)))),
          lambda_(float(young * poisson / ((1 + poisson) * (1 - 2 * poisson)))),
          nodes_(side_ * side_ * side_) {}

    /// \param dt  [s]
    void step(float dt) {
        find_box();
        clear_grid();
        particles_to_grid(dt);
        update_grid(dt);
        grid_to_particles(dt);
    }

private:
    /// The 3³ nodes around a particle.
    struct Stencil {
        Eigen::Array3i base;  ///< the first of them
        Eigen::Array3f fx;    ///< of the particle, from there, in cells
        Eigen::Array3f w[3];  ///< weights by node and axis

        Stencil(const Eigen::Vector3f& x, float h) {
            const Eigen::Array3f X = x.array() / h;
            base = (X - 0.5f).floor().cast<int>();
            fx = X - base.cast<float>();
            w[0] = 0.5f * (1.5f - fx).square();
            w[1] = 0.75f - (fx - 1.0f).square();
            w[2] = 0.5f * (fx - 0.5f).square();
        }
    };

    /// Momentum (after the update: velocity) and mass. Nodes −1 and cells + 1 lie outside of the box.
    Eigen::Vector4f& node(int i, int j, int k) {
        return nodes_[(std::size_t(i + 1) * side_ + std::size_t(j + 1)) * side_ + std::size_t(k + 1)];
    }

    /// Only nodes near matter are cleared and updated.
    void find_box() {
        Eigen::AlignedBox3f extent;
        for (const Particle& p : particles) extent.extend(p.x);
        first_ = Stencil(extent.min(), h_).base;
        last_ = Stencil(extent.max(), h_).base + 2;
    }

    void clear_grid() {
        for (int i = first_[0]; i <= last_[0]; ++i)
            for (int j = first_[1]; j <= last_[1]; ++j)
                std::fill(&node(i, j, first_[2]), &node(i, j, last_[2]) + 1, Eigen::Vector4f::Zero());
    }

    void particles_to_grid(float dt) {
        for (const Particle& p : particles) {
            const Stencil s(p.x, h_);
            const Eigen::Matrix3f affine = mass_ * p.C - (dt * volume_ * 4 / (h_ * h_)) * kirchhoff_stress(p.F);
            Eigen::Matrix<float, 4, 3> A;  // momentum and mass by cells from the first node
            A << affine * h_, Eigen::RowVector3f::Zero();
            Eigen::Vector4f at_base;
            at_base << mass_ * p.v, mass_;
            at_base -= A * s.fx.matrix();
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 3; ++j) {
                    Eigen::Vector4f* row = &node(s.base[0] + i, s.base[1] + j, s.base[2]);
                    const float w = s.w[i][0] * s.w[j][1];
                    const Eigen::Vector4f at_row = at_base + float(i) * A.col(0) + float(j) * A.col(1);
                    for (int k = 0; k < 3; ++k) row[k] += (w * s.w[k][2]) * (at_row + float(k) * A.col(2));
                }
            }
        }
    }

    void update_grid(float dt) {
        for (int i = first_[0]; i <= last_[0]; ++i) {
            for (int j = first_[1]; j <= last_[1]; ++j) {
                for (int k = first_[2]; k <= last_[2]; ++k) {
                    Eigen::Vector4f& n = node(i, j, k);
                    if (n[3] <= 0) continue;
                    Eigen::Vector3f v = n.head<3>() / n[3] + dt * gravity;
                    const int index[] = {i, j, k};
                    for (int a = 0; a < 3; ++a) {
                        if (index[a] <= 0) v[a] = std::max(v[a], 0.0f);
                        if (index[a] >= cells_) v[a] = std::min(v[a], 0.0f);
                    }
                    n.head<3>() = v;
                }
            }
        }
    }

    void grid_to_particles(float dt) {
        for (Particle& p : particles) {
            const Stencil s(p.x, h_);
            Eigen::Vector4f v = Eigen::Vector4f::Zero();
            Eigen::Matrix<float, 4, 3> B = Eigen::Matrix<float, 4, 3>::Zero();
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 3; ++j) {
                    const Eigen::Vector4f* row = &node(s.base[0] + i, s.base[1] + j, s.base[2]);
                    for (int k = 0; k < 3; ++k) {
                        const Eigen::Vector3f d = Eigen::Vector3f(float(i), float(j), float(k)) - s.fx.matrix();
                        const Eigen::Vector4f weighted = (s.w[i][0] * s.w[j][1] * s.w[k][2]) * row[k];
                        v += weighted;
                        B += weighted * d.transpose();
                    }
                }
            }
            p.v = v.head<3>();
            p.C = (4 / h_) * B.topRows<3>();
            p.F = (Eigen::Matrix3f::Identity() + dt * p.C) * p.F;
            p.x = (p.x + dt * p.v).cwiseMax(0.0f).cwiseMin(1.0f);
        }
    }

    /// τ = 2μ (F − R) Fᵀ + λ (J − 1) J I, with R the nearest rotation to F.
    Eigen::Matrix3f kirchhoff_stress(const Eigen::Matrix3f& F) const {
        const Eigen::JacobiSVD<Eigen::Matrix3f> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
        Eigen::Matrix3f U = svd.matrixU();
        const float J = F.determinant();
        if (J < 0) U.col(2) *= -1;
        const Eigen::Matrix3f R = U * svd.matrixV().transpose();
        return 2 * mu_ * (F - R) * F.transpose() + lambda_ * (J - 1) * J * Eigen::Matrix3f::Identity();
    }

    int cells_;
    std::size_t side_;  ///< of the grid, in nodes
    float h_, mass_, volume_, mu_, lambda_;
    std::vector<Eigen::Vector4f> nodes_;
    Eigen::Array3i first_, last_;  ///< nodes near matter
};

}  // namespace baseline
