//! The integration tests, one binary.

#[cfg(feature = "cli")]
mod all_states;
mod arrows;
mod assembly;
#[cfg(feature = "scene")]
mod assembly_branches;
mod assembly_index;
mod assembly_statics;
mod bar_heavy;
mod bar_laws;
#[cfg(feature = "scene")]
mod bar_scenes;
mod bar_schemes;
mod bar_strong;
mod bar_waves;
mod bodies_in_space_that_hit;
mod bodies_on_damped_rods_that_hit;
mod bodies_on_rods_that_hit;
mod bodies_that_hit;
mod bounces_space;
#[cfg(feature = "scene")]
mod branch_folds;
#[cfg(feature = "scene")]
mod branch_folds_assemblies;
#[cfg(feature = "scene")]
mod branch_points;
mod breaks;
mod budget;
mod capstans;
#[cfg(feature = "scene")]
mod cheap_paths;
mod clamps;
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "cli")]
mod cli_input;
#[cfg(feature = "cli")]
mod cli_memory;
#[cfg(feature = "cli")]
mod cli_motion;
#[cfg(feature = "cli")]
mod cli_motion_units;
#[cfg(feature = "cli")]
mod cli_output;
#[cfg(feature = "cli")]
mod cli_statics;
mod contacts;
mod continuation;
#[cfg(feature = "scene")]
mod derivatives;
mod documents;
#[cfg(feature = "cli")]
mod driven_motions;
mod dynamics;
mod eightfold;
mod elastica;
mod elliptic;
mod elliptic_data;
#[cfg(feature = "scene")]
mod extremes;
#[cfg(feature = "cli")]
mod figures;
mod first_order_clamps;
mod first_order_held;
mod first_order_pins;
#[cfg(feature = "scene")]
mod first_order_pins_scenes;
#[cfg(feature = "scene")]
mod first_order_scenes;
mod first_order_space;
mod first_order_taut;
#[cfg(feature = "scene")]
mod fit;
#[cfg(feature = "scene")]
mod flow_scenes;
mod folds_in_assemblies;
#[cfg(feature = "scene")]
mod folds_in_space;
#[cfg(feature = "scene")]
mod follower_loads;
#[cfg(feature = "cli")]
mod free_ends;
#[cfg(feature = "scene")]
mod friction_along_rods;
#[cfg(feature = "scene")]
mod fuzzed;
#[cfg(feature = "scene")]
mod fuzzed_seeds;
#[cfg(feature = "scene")]
mod groove_ends;
mod grooves;
#[cfg(feature = "scene")]
mod heavy_assemblies;
#[cfg(feature = "scene")]
mod heavy_bounces;
#[cfg(feature = "scene")]
mod heavy_branches;
#[cfg(feature = "scene")]
mod heavy_elements;
#[cfg(feature = "scene")]
mod heavy_grooves;
#[cfg(feature = "scene")]
mod heavy_loops;
#[cfg(feature = "scene")]
mod heavy_memory;
#[cfg(feature = "scene")]
mod heavy_obstacles;
mod heavy_released;
mod heavy_rest;
mod heavy_rods;
#[cfg(feature = "scene")]
mod heavy_scenes;
mod hockle;
mod impacts;
mod inertia;
#[cfg(feature = "scene")]
mod inflation_scenes;
mod inversion;
#[cfg(feature = "scene")]
mod joints;
#[cfg(feature = "scene")]
#[cfg(all(feature = "cli", unix))]
mod kills;
mod landings;
mod landings_space;
#[cfg(feature = "cli")]
mod light_frames;
mod light_turning_loads;
mod light_weight;
mod light_weight_scenes;
mod load_functions;
#[cfg(feature = "cli")]
mod load_list;
mod loads;
#[cfg(feature = "scene")]
mod mass_motions;
#[cfg(feature = "scene")]
mod mass_numbers_space;
mod membrane_motion;
mod membranes;
mod memory;
mod memory_kernel;
mod memory_motion;
#[cfg(feature = "scene")]
mod messages;
#[cfg(feature = "cli")]
mod modes;
mod motion_in_space;
#[cfg(feature = "cli")]
mod moving_joints;
#[cfg(feature = "cli")]
#[cfg(feature = "scene")]
mod obstacle_scenes;
#[cfg(feature = "cli")]
#[cfg(feature = "scene")]
mod obstacle_scenes_in_space;
mod obstacles;
mod outputs;
#[cfg(feature = "cli")]
mod pages;
#[cfg(feature = "scene")]
mod pairs;
mod pins;
mod piston;
#[cfg(feature = "plot")]
mod plot;
#[cfg(feature = "plot")]
mod plot_data;
#[cfg(feature = "plot")]
mod plot_rods;
#[cfg(feature = "plot")]
mod plot_rods_data;
#[cfg(feature = "plot")]
mod plot_viscous;
#[cfg(feature = "plot")]
mod plot_viscous_data;
#[cfg(feature = "plot")]
mod plot_ways;
#[cfg(feature = "cli")]
mod printed;
#[cfg(feature = "cli")]
mod program;
#[cfg(feature = "scene")]
mod records;
mod reductions;
mod reductions_shear;
#[cfg(feature = "scene")]
mod rest_centreline;
mod rigid_body;
mod rod_benchmarks;
mod rod_index;
mod rod_mass;
#[cfg(feature = "scene")]
mod rod_mass_scenes;
mod rod_paths;
mod rod_published;
mod rods;
#[cfg(feature = "cli")]
mod rods_alone;
mod rods_invariants;
mod rods_meet;
mod rods_touch_in_motion;
#[cfg(feature = "scene")]
mod scene;
#[cfg(feature = "scene")]
mod scene_assemblies;
#[cfg(feature = "scene")]
mod scene_refusals;
mod scene_rods;
#[cfg(feature = "scene")]
mod scene_scales;
#[cfg(feature = "scene")]
mod scene_spatial;
#[cfg(feature = "scene")]
mod scene_starts;
#[cfg(feature = "scene")]
mod scene_viscous;
mod schema;
mod sections;
mod sections_nonlinear;
mod settled;
#[cfg(feature = "cli")]
mod shapes_along;
#[cfg(feature = "scene")]
mod simulations;
#[cfg(feature = "cli")]
mod small_creep;
mod stable_count;
#[cfg(feature = "scene")]
mod start_kinds;
mod stations;
mod stiff;
mod stiff_rods;
mod stiff_stubs;
mod straight;
mod straight_starts;
#[cfg(feature = "scene")]
mod stress;
#[cfg(feature = "scene")]
mod stress_scenes;
#[cfg(feature = "scene")]
mod studies;
#[cfg(feature = "scene")]
mod study_run;
mod support;
#[cfg(feature = "cli")]
mod sweeps;
mod symmetric;
mod taut;
mod taut_branches;
mod taut_loads;
mod taut_mass;
#[cfg(feature = "scene")]
mod tendons;
mod touching_rods;
mod truss;
mod tube_flow;
mod tube_ring;
#[cfg(feature = "scene")]
mod turning_loads;
mod viscous;
mod viscous_identities;
mod viscous_laws;
mod viscous_space;
mod viscous_space_runs;
#[cfg(feature = "cli")]
mod wall_scenes;
#[cfg(feature = "cli")]
mod widths;
#[cfg(feature = "scene")]
mod zero_modes;
