//! Derives of Bevy's traits that generate nothing.

use proc_macro::TokenStream;

#[proc_macro_derive(Asset)]
pub fn asset(_: TokenStream) -> TokenStream {
    TokenStream::new()
}

#[proc_macro_derive(TypePath)]
pub fn type_path(_: TokenStream) -> TokenStream {
    TokenStream::new()
}

#[proc_macro_derive(Reflect, attributes(reflect))]
pub fn reflect(_: TokenStream) -> TokenStream {
    TokenStream::new()
}
