//! Tests of the library's public interface: against independent code, recorded files, and its own documentation.

#[path = "../support/c3d.rs"]
mod c3d;
mod contact_real_files;
mod edited_motions;
mod editing_real_files;
mod export_formats;
mod filming;
mod fitted_skins;
mod fixed_feet_never_sink;
mod forward_kinematics;
#[path = "../support/glb.rs"]
mod glb;
mod heel_strikes;
mod joint_map_keys;
mod keypoints;
mod keys_page;
mod kinematics_agree_with_rapier;
mod layers_agree_with_rays;
#[path = "../../crates/test_support/made_up_set.rs"]
#[allow(unreachable_pub, reason = "crates/set shares it")]
mod made_up_set;
mod markers;
mod mocap_real_files;
mod opencv_projection;
#[path = "../support/ray_scene.rs"]
mod ray_scene;
mod retarget_real_files;
mod root_functions;
mod set_for_others;
mod shipped_recordings;
mod silhouettes_agree_with_rays;
mod simulated_walks_stay_up;
mod skin;
#[path = "../support/mod.rs"]
mod support;
mod units_of_recordings;
mod verdicts_of_runs;
#[path = "../support/walks.rs"]
mod walks;
