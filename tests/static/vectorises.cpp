// Each policy on a register of float lanes, in a function of its own, for check_vectorised.sh to look at: its
// arithmetic must be packed. FIRN_PLANT_SCALAR makes one of them work lane by lane, to see that the check would notice.
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/core/pack.hpp>
#include <firn/force/mls.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/stage/g2p.hpp>
#include <firn/stage/grid_update.hpp>
#include <firn/stage/p2g.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/pic.hpp>

using namespace firn;

namespace {

using P = native_pack<float>;
constexpr int lanes = scalar_traits<P>::lanes;
using Kernel = QuadraticBSpline;

struct Input {
    const float* next;
    P scalar() {
        const P p = P::load(next);
        next += lanes;
        return p;
    }
    template <int D>
    Vec<P, D> vector() {
        Vec<P, D> r;
        unroll<D>([&](auto i) FIRN_LAMBDA { r.v[i] = scalar(); });
        return r;
    }
    template <int D>
    Mat<P, D> matrix() {
        Mat<P, D> r;
        unroll<D * D>([&](auto i) FIRN_LAMBDA { r.m[i] = scalar(); });
        return r;
    }
};

struct Output {
    float* next;
    void put(const P& p) {
        p.store(next);
        next += lanes;
    }
    template <std::size_t N>
    void put(const std::array<P, N>& a) {
        unroll<int(N)>([&](auto i) FIRN_LAMBDA { put(a[i]); });
    }
    template <int D>
    void put(const Vec<P, D>& a) {
        unroll<D>([&](auto i) FIRN_LAMBDA { put(a.v[i]); });
    }
    template <int D>
    void put(const Mat<P, D>& a) {
        unroll<D * D>([&](auto i) FIRN_LAMBDA { put(a.m[i]); });
    }
};

template <class Transfer, class Force, int D>
FIRN_INLINE void record(Input in, Output out) {
    P2GParticle<P, D> particle;
    particle.mass = in.scalar();
    particle.volume = in.scalar();
    particle.velocity = in.vector<D>();
    particle.affine = in.matrix<D>();
    particle.stress = in.matrix<D>();
    const Vec<P, D> d = in.vector<D>();
    const P h = in.scalar(), dt = in.scalar();
    const auto r = make_record<Kernel, Transfer, Force>(particle, d, h, dt);
    out.put(r.mass);
    out.put(r.momentum);
    out.put(r.affine);
    out.put(r.gradient);
}

template <class Transfer, class Force, int D>
FIRN_INLINE void taken(Input in, Output out) {
    const G2PSums<P, D> sums{in.vector<D>(), in.matrix<D>(), in.matrix<D>()};
    const Vec<P, D> d = in.vector<D>();
    const auto r = take_from_grid<Kernel, Transfer, Force>(sums, d, in.scalar());
    out.put(r.velocity);
    out.put(r.affine);
    out.put(r.velocity_gradient);
}

template <int D>
FIRN_INLINE void stress(const FixedCorotated<P>& model, Input in, Output out) {
    out.put(model.kirchhoff_stress(in.matrix<D>()));
}
template <int D>
FIRN_INLINE void speed(const FixedCorotated<P>& model, Input in, Output out) {
    const P density = in.scalar();
    out.put(model.wave_speed(density, in.matrix<D>()));
}
template <int D, class Boundary>
FIRN_INLINE void node(const Boundary& boundary, Input in, Output out) {
    const P mass = in.scalar(), dt = in.scalar();
    const Vec<P, D> momentum = in.vector<D>(), x = in.vector<D>(), acceleration = in.vector<D>();
    out.put(node_velocity(momentum, mass, x, acceleration, dt, boundary));
}

template <int D>
using Solids = Together<Collider<Capsule<P, D>>, Collider<Complement<Box<P, D>>>>;

}  // namespace

#define FIRN_LOOKED_AT extern "C" [[gnu::noinline]] void

// Declared before they are defined: only the script knows them.
extern "C" {
void firn_kernel(const float* in, float* out);
void firn_record_apic_mls_2d(const float* in, float* out);
void firn_record_apic_mls_3d(const float* in, float* out);
void firn_record_pic_gradient_3d(const float* in, float* out);
void firn_taken_apic_mls_3d(const float* in, float* out);
void firn_taken_pic_gradient_3d(const float* in, float* out);
void firn_stress_2d(const FixedCorotated<P>& model, const float* in, float* out);
void firn_stress_3d(const FixedCorotated<P>& model, const float* in, float* out);
void firn_wave_speed_3d(const FixedCorotated<P>& model, const float* in, float* out);
void firn_node_2d(const Walls<P, 2>& walls, const float* in, float* out);
void firn_node_3d(const Walls<P, 3>& walls, const float* in, float* out);
void firn_solid_2d(const Solids<2>& solids, const float* in, float* out);
void firn_solid_3d(const Solids<3>& solids, const float* in, float* out);
}

FIRN_LOOKED_AT firn_kernel(const float* in, float* out) {
    Output to{out};
    const P f = P::load(in);
#ifdef FIRN_PLANT_SCALAR
    for (int l = 0; l < lanes; ++l) {
        float product = in[l] * in[l + lanes];
        asm volatile("" : "+x"(product));  // kept apart from its neighbours
        out[10 * lanes + l] = product;
    }
#endif
    to.put(Kernel::weights(f));
    to.put(Kernel::gradients(f));
}
FIRN_LOOKED_AT firn_record_apic_mls_2d(const float* in, float* out) { record<Apic, MlsForce, 2>({in}, {out}); }
FIRN_LOOKED_AT firn_record_apic_mls_3d(const float* in, float* out) { record<Apic, MlsForce, 3>({in}, {out}); }
FIRN_LOOKED_AT firn_record_pic_gradient_3d(const float* in, float* out) {
    record<Pic, WeightGradientForce, 3>({in}, {out});
}
FIRN_LOOKED_AT firn_taken_apic_mls_3d(const float* in, float* out) { taken<Apic, MlsForce, 3>({in}, {out}); }
FIRN_LOOKED_AT firn_taken_pic_gradient_3d(const float* in, float* out) {
    taken<Pic, WeightGradientForce, 3>({in}, {out});
}
FIRN_LOOKED_AT firn_stress_2d(const FixedCorotated<P>& model, const float* in, float* out) {
    stress<2>(model, {in}, {out});
}
FIRN_LOOKED_AT firn_stress_3d(const FixedCorotated<P>& model, const float* in, float* out) {
    stress<3>(model, {in}, {out});
}
FIRN_LOOKED_AT firn_wave_speed_3d(const FixedCorotated<P>& model, const float* in, float* out) {
    speed<3>(model, {in}, {out});
}
FIRN_LOOKED_AT firn_node_2d(const Walls<P, 2>& walls, const float* in, float* out) { node<2>(walls, {in}, {out}); }
FIRN_LOOKED_AT firn_node_3d(const Walls<P, 3>& walls, const float* in, float* out) { node<3>(walls, {in}, {out}); }
FIRN_LOOKED_AT firn_solid_2d(const Solids<2>& solids, const float* in, float* out) { node<2>(solids, {in}, {out}); }
FIRN_LOOKED_AT firn_solid_3d(const Solids<3>& solids, const float* in, float* out) { node<3>(solids, {in}, {out}); }
