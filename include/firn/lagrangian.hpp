/// \file Includes all headers for the simulation of point masses: springs, constraints, cloth, soft bodies, collisions,
/// emitters.
///
/// Walls, moving solids and shapes are included, too; they are the boundaries of a ParticleSystem. Point masses need no
/// grid, and firn.hpp need not be included. To put nets (points and the links between them) on the grid of a
/// simulation, see Simulation::add_force().
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/lagrangian/any_force.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/collision_grid.hpp>
#include <firn/lagrangian/collisions.hpp>
#include <firn/lagrangian/colouring.hpp>
#include <firn/lagrangian/contact_table.hpp>
#include <firn/lagrangian/distance_constraints.hpp>
#include <firn/lagrangian/drag.hpp>
#include <firn/lagrangian/element_forces.hpp>
#include <firn/lagrangian/emitter.hpp>
#include <firn/lagrangian/excluded_pairs.hpp>
#include <firn/lagrangian/impact.hpp>
#include <firn/lagrangian/incidence.hpp>
#include <firn/lagrangian/integrator.hpp>
#include <firn/lagrangian/membrane.hpp>
#include <firn/lagrangian/net.hpp>
#include <firn/lagrangian/net_forces.hpp>
#include <firn/lagrangian/particle_system.hpp>
#include <firn/lagrangian/point_forces.hpp>
#include <firn/lagrangian/point_masses.hpp>
#include <firn/lagrangian/rope.hpp>
#include <firn/lagrangian/soft_body.hpp>
#include <firn/lagrangian/spring.hpp>
#include <firn/lagrangian/surface.hpp>
#include <firn/lagrangian/surface_contact.hpp>
#include <firn/lagrangian/tearing.hpp>
