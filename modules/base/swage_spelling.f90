!> Suggestions for misspelt words.
module swage_spelling
  implicit none(type, external)
  private

  public :: edit_distance, nearest_word, did_you_mean, listed

contains

  !> Number of letters to insert, delete, replace or swap with their neighbour to turn one word
  !> into the other; trailing blanks do not count.
  !>
  !> Source: Damerau (1964), in the restricted form that edits no place twice.
  pure function edit_distance(first, second) result(distance)
    character(len=*), intent(in) :: first
    character(len=*), intent(in) :: second
    integer :: distance

    integer :: cost(0:len_trim(first), 0:len_trim(second))
    integer :: change, i, j

    do i = 0, len_trim(first)
      cost(i, 0) = i
    end do
    do j = 0, len_trim(second)
      cost(0, j) = j
    end do
    do j = 1, len_trim(second)
      do i = 1, len_trim(first)
        change = merge(0, 1, first(i:i) == second(j:j))
        cost(i, j) = min(cost(i - 1, j) + 1, cost(i, j - 1) + 1, cost(i - 1, j - 1) + change)
        if (i > 1 .and. j > 1) then
          if (first(i - 1:i) == second(j:j)//second(j - 1:j - 1)) then
            ! Workaround: gfortran 12, its warning about the bounds does not see the conditions
            cost(i, j) = min(cost(i, j), cost(max(i - 2, 0), max(j - 2, 0)) + change)
          end if
        end if
      end do
    end do
    distance = cost(len_trim(first), len_trim(second))

  end function edit_distance

  !> Place of the candidate that was probably meant, 0 when none comes close.
  !>
  !> Close are words that differ in at most every third letter, and, failing these, the first of
  !> those that continue the word or are continued by it.
  pure function nearest_word(word, candidates) result(place)
    character(len=*), intent(in) :: word
    character(len=*), intent(in) :: candidates(:)
    integer :: place

    integer :: distance, i, smallest

    place = 0
    smallest = (len_trim(word) + 2) / 3 + 1
    do i = 1, size(candidates)
      distance = edit_distance(word, candidates(i))
      if (distance >= smallest) cycle
      smallest = distance
      place = i
    end do
    if (place > 0) return

    do i = 1, size(candidates)
      if (min(len_trim(word), len_trim(candidates(i))) < 3) cycle
      if (index(candidates(i), trim(word)) /= 1 .and. index(word, trim(candidates(i))) /= 1) cycle
      place = i
      return
    end do

  end function nearest_word

  !> End of a complaint: `: did you mean 'young'?`, or a full stop when no candidate comes close.
  pure function did_you_mean(word, candidates) result(question)
    character(len=*), intent(in) :: word
    character(len=*), intent(in) :: candidates(:)
    character(len=:), allocatable :: question

    integer :: place

    question = '.'
    place = nearest_word(word, candidates)
    if (place > 0) question = ': did you mean '''//trim(candidates(place))//'''?'

  end function did_you_mean

  !> The words of a list, separated.
  pure function listed(words, separator, quote) result(sentence)
    character(len=*), intent(in) :: words(:)
    character(len=*), intent(in) :: separator
    !> Put around each word, or nothing.
    character(len=*), intent(in) :: quote
    character(len=:), allocatable :: sentence

    integer :: i

    sentence = ''
    do i = 1, size(words)
      if (i > 1) sentence = sentence//separator
      sentence = sentence//quote//trim(words(i))//quote
    end do

  end function listed

end module swage_spelling
