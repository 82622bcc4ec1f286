/// \file Includes what rigid bodies need beside firn.hpp: bodies that matter pushes, and what drives them.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/drive.hpp>
#include <firn/boundary/rigid_body.hpp>
#include <firn/loops/rigid_contact.hpp>
#include <firn/simulation.hpp>
