//! Buttons of controllers. Runtimes map those of other controllers onto one of these profiles.

/// What a button does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Input {
    Aim,
    Grip,
    Trigger,
    Stick,
    StickPressed,
    Shape,
    Operation,
}

/// Inputs, with the components of a controller that they come from.
type Inputs = &'static [(Input, &'static str)];

/// Inputs of one kind of controller.
pub struct Profile {
    pub path: &'static str,
    /// Inputs that both hands have.
    both: [Inputs; 2],
    /// Inputs of the left and the right hand.
    sides: [Inputs; 2],
}

/// The hands' paths, left and right.
pub const HANDS: [&str; 2] = ["/user/hand/left", "/user/hand/right"];

/// Inputs of controllers with a thumbstick.
const WITH_STICK: Inputs = &[
    (Input::Aim, "input/aim/pose"),
    (Input::Trigger, "input/trigger/value"),
    (Input::Stick, "input/thumbstick"),
    (Input::StickPressed, "input/thumbstick/click"),
];
const NONE: [Inputs; 2] = [&[], &[]];

pub const PROFILES: [Profile; 5] = [
    Profile {
        path: "/interaction_profiles/oculus/touch_controller",
        both: [WITH_STICK, &[(Input::Grip, "input/squeeze/value")]],
        sides: [
            &[(Input::Shape, "input/x/click"), (Input::Operation, "input/y/click")],
            &[(Input::Shape, "input/a/click"), (Input::Operation, "input/b/click")],
        ],
    },
    Profile {
        path: "/interaction_profiles/valve/index_controller",
        both: [
            WITH_STICK,
            &[
                (Input::Grip, "input/squeeze/value"),
                (Input::Shape, "input/a/click"),
                (Input::Operation, "input/b/click"),
            ],
        ],
        sides: NONE,
    },
    Profile {
        path: "/interaction_profiles/microsoft/motion_controller",
        both: [
            WITH_STICK,
            &[
                (Input::Grip, "input/squeeze/click"),
                (Input::Shape, "input/trackpad/click"),
                (Input::Operation, "input/menu/click"),
            ],
        ],
        sides: NONE,
    },
    Profile {
        path: "/interaction_profiles/htc/vive_controller",
        both: [
            &[(Input::Aim, "input/aim/pose"), (Input::Trigger, "input/trigger/value")],
            &[
                (Input::Grip, "input/squeeze/click"),
                (Input::Stick, "input/trackpad"),
                (Input::StickPressed, "input/trackpad/click"),
                (Input::Shape, "input/menu/click"),
            ],
        ],
        sides: NONE,
    },
    // It has two buttons alone, and no grip: things stay where they are.
    Profile {
        path: "/interaction_profiles/khr/simple_controller",
        both: [
            &[(Input::Aim, "input/aim/pose")],
            &[(Input::Trigger, "input/select/click"), (Input::Shape, "input/menu/click")],
        ],
        sides: NONE,
    },
];

impl Profile {
    /// Full paths of an input.
    pub fn paths_of(&self, input: Input) -> Vec<String> {
        let of_side = |(hand, side): (&str, Inputs)| {
            let inputs = self.both.into_iter().chain([side]).flatten().filter(|(of, _)| *of == input);
            inputs.map(|(_, component)| format!("{hand}/{component}")).collect::<Vec<_>>()
        };
        HANDS.into_iter().zip(self.sides).flat_map(of_side).collect()
    }
}
